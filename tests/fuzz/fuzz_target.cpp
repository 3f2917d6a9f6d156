// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz_target.hpp"

#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <new>

namespace {

std::atomic<std::size_t> g_now{0};
std::atomic<std::size_t> g_peak{0};

void* take(std::size_t size, std::size_t alignment) {
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size == 0 ? 1 : size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  const std::size_t now = g_now += malloc_usable_size(memory);
  std::size_t peak = g_peak;
  while (now > peak && !g_peak.compare_exchange_weak(peak, now)) {
  }
  return memory;
}

void* take_or_null(std::size_t size) noexcept {
  try {
    return take(size, 1);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

void give(void* memory) noexcept {
  if (memory == nullptr) return;
  g_now -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) { return take(size, 1); }
void* operator new[](std::size_t size) { return take(size, 1); }
void* operator new(std::size_t size, std::align_val_t a) { return take(size, static_cast<std::size_t>(a)); }
void* operator new[](std::size_t size, std::align_val_t a) { return take(size, static_cast<std::size_t>(a)); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return take_or_null(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return take_or_null(size); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { give(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { give(memory); }
void operator delete(void* memory) noexcept { give(memory); }
void operator delete[](void* memory) noexcept { give(memory); }
void operator delete(void* memory, std::size_t) noexcept { give(memory); }
void operator delete[](void* memory, std::size_t) noexcept { give(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { give(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { give(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { give(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { give(memory); }

namespace plumbline::fuzz {

MemoryWatch::MemoryWatch() { g_peak = g_now.load(); }

std::size_t MemoryWatch::peak() const { return g_peak; }

void check_memory(const MemoryWatch& watch, std::size_t decoded) {
  if (watch.peak() <= allowance(decoded)) return;
  std::fprintf(stderr, "%zu bytes allocated at once for contents of %zu bytes\n", watch.peak(), decoded);
  std::abort();
}

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "violated: %s\n", what);
  std::abort();
}

InputFile::InputFile(const std::uint8_t* data, std::size_t size, const char* ending) {
  // Shared memory where there is some: thousands of inputs a second.
  const std::filesystem::path shared = "/dev/shm";
  const auto folder = access(shared.c_str(), W_OK) == 0 ? shared : std::filesystem::temp_directory_path();
  path_ = folder / ("plumbline_fuzz_" + std::to_string(getpid()) + ending);
  std::ofstream(path_, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
}

void require_message(const std::string& message, const std::string& file) {
  require(!message.empty(), "an error has a message");
  require(message.size() < 100000, "a message can be read");
  require(message.find(file) != std::string::npos, "a message names the file");
}

}  // namespace plumbline::fuzz
