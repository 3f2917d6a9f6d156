// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/output_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "plumbline/core/shortage.hpp"

namespace plumbline::core {
namespace {

constexpr std::size_t kBuffer = std::size_t{1} << 20;

/// Advice for a user whose file the system refused to write.
const char* remedy(int cause) {
  switch (cause) {
    case ENOENT:
      return "make the folder first";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a folder that you may write to";
    case EISDIR:
      return "name a file";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "free space or choose another disk";
    default:
      return "choose another folder";
  }
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path target) : target_(std::move(target)) {
  std::error_code error;
  std::filesystem::path real = target_;
  if (std::filesystem::is_symlink(target_, error)) {  // keep the link and replace its target
    auto resolved = std::filesystem::weakly_canonical(target_, error);
    if (!error) real = std::move(resolved);
  }

  // Folders cannot be replaced by files
  if (std::filesystem::is_directory(real, error)) {
    problem_ = target_.string() + ": is a folder; " + remedy(EISDIR);
    return;
  }

  // Pipes and devices are written in place; a file is written elsewhere and renamed
  const bool device = std::filesystem::exists(real, error) && !std::filesystem::is_regular_file(real, error);
  if (device) {
    written_ = real;
    descriptor_ = ::open(written_.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    written_ =
        real.parent_path() / ("." + real.filename().string() + "." + std::to_string(::getpid()) + ".part");
    descriptor_ = ::open(written_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  }

  // The cause decides the advice
  if (descriptor_ < 0) {
    fail("cannot be opened for writing", errno);
    return;
  }

  // Errors name the file that the link points to
  target_ = real;
  buffer_.reserve(kBuffer);
}

OutputFile::~OutputFile() { discard(); }

void OutputFile::write(const void* bytes, std::size_t count) {
  if (!problem_.empty()) return;
  const char* from = static_cast<const char*>(bytes);

  // Small writes are collected; the system is called for full buffers only
  while (count > 0) {
    const std::size_t part = std::min(count, kBuffer - buffer_.size());
    buffer_.insert(buffer_.end(), from, from + part);
    from += part;
    count -= part;
    if (buffer_.size() == kBuffer) flush();
  }
}

void OutputFile::flush() {
  std::size_t done = 0;

  // A signal may interrupt a write; it is then repeated
  while (done < buffer_.size() && problem_.empty()) {
    const ssize_t n = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (n >= 0) {
      done += static_cast<std::size_t>(n);
    } else if (errno != EINTR) {
      fail("cannot be written", errno);
    }
  }
  buffer_.clear();
}

void OutputFile::fail(const std::string& what, int cause) {
  if (!problem_.empty()) return;
  const std::string shortage = shortage_of(cause);
  problem_ = target_.string() + ": " + what + " (" + std::strerror(cause) + "); " +
             (shortage.empty() ? remedy(cause) : shortage);
}

void OutputFile::discard() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  descriptor_ = -1;
  if (written_ != target_) ::unlink(written_.c_str());
}

Result<void> OutputFile::commit() {
  if (problem_.empty()) flush();
  if (problem_.empty()) {
    const int descriptor = descriptor_;
    descriptor_ = -1;
    // A full disk may show only here (delayed allocation on network folders).
    if (::close(descriptor) != 0) {
      fail("cannot be written", errno);
      if (written_ != target_) ::unlink(written_.c_str());
    } else if (written_ != target_ && ::rename(written_.c_str(), target_.c_str()) != 0) {
      fail("cannot be replaced", errno);
      ::unlink(written_.c_str());
    }
  }
  discard();
  return problem_.empty() ? Result<void>() : output_error(problem_);
}

Result<void> check_writable(const std::filesystem::path& file) {
  std::error_code ec;
  if (std::filesystem::exists(file, ec) && !std::filesystem::is_regular_file(file, ec) &&
      !std::filesystem::is_directory(file, ec))
    return {};  // opening and closing a pipe would end it for its reader
  OutputFile out(file);
  return out.good() ? Result<void>() : out.commit();
}

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code ec;
  std::filesystem::create_directories(folder, ec);
  if (!ec) return {};
  return output_error(folder.string() + ": cannot be created (" + ec.message() + "); " + remedy(ec.value()));
}

Result<void> write_file(const std::filesystem::path& file, std::string_view bytes) {
  OutputFile out(file);
  out.write(bytes);
  return out.commit();
}

Result<void> write_file(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes) {
  return write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace plumbline::core
