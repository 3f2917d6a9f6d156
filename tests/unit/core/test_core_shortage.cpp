// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <new>
#include <stdexcept>
#include <system_error>

#include "plumbline/core/output_file.hpp"
#include "plumbline/core/shortage.hpp"

namespace plumbline::core {
namespace {

TEST(Shortage, IsNeitherABugNorTheInput) {
  const Error memory = error_of(std::bad_alloc());
  EXPECT_EQ(memory.kind, ErrorKind::kOutput);
  EXPECT_NE(memory.message.find("not enough memory"), std::string::npos) << memory.message;

  const std::system_error thread(EAGAIN, std::generic_category(), "thread");
  EXPECT_EQ(error_of(thread).kind, ErrorKind::kOutput);
  EXPECT_NE(error_of(thread).message.find("ulimit -u"), std::string::npos);
  EXPECT_EQ(error_of(std::system_error(EMFILE, std::generic_category())).kind, ErrorKind::kOutput);

  const std::runtime_error opencv(
      "OpenCV(4.6.0) alloc.cpp:73: error: (-4:Insufficient memory) Failed to allocate 921600 bytes");
  EXPECT_EQ(error_of(opencv).message, memory.message);

  const Error bug = error_of(std::logic_error("an index is out of range"));
  EXPECT_EQ(bug.kind, ErrorKind::kInternal);
  EXPECT_EQ(bug.message, "an index is out of range");
  EXPECT_EQ(error_of(std::system_error(ENOENT, std::generic_category())).kind, ErrorKind::kInternal);
}

TEST(Shortage, OfTheLinkerIsToldFromADamagedLibrary) {
  for (const char* memory : {"a.so: failed to map segment from shared object",
                             "libb.so.1: cannot open shared object file: Cannot allocate memory",
                             "a.so: cannot map zero-fill pages"})
    EXPECT_NE(shortage_of_linker(memory).find("memory"), std::string::npos) << memory;
  EXPECT_NE(shortage_of_linker("a.so: cannot open shared object file: Too many open files").find("ulimit -n"),
            std::string::npos);
  for (const char* other : {"a.so: file too short", "a.so: undefined symbol: f", "libc.so.6: no such file"})
    EXPECT_EQ(shortage_of_linker(other), "") << other;
}

TEST(Shortage, OfFilesIsSeenWhileItLasts) {
  EXPECT_FALSE(files_are_short());
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const int next = dup(0);
  ASSERT_GE(next, 0);
  close(next);
  const rlimit none{static_cast<rlim_t>(next), before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const bool are_short = files_are_short();
  const auto written = write_file(testing::TempDir() + "/plumbline_short.txt", "x");
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);

  EXPECT_TRUE(are_short);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("ulimit -n"), std::string::npos) << written.error().message;
}

}  // namespace
}  // namespace plumbline::core
