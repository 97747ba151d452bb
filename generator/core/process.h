// SPDX-License-Identifier: GPL-3.0-or-later
// What the operating system knows of processes, terminals and names: all that is not the same on Linux, macOS and
// Windows.
#pragma once

#include <cstddef>
#include <filesystem>

namespace brdfc::inline core {

/// The number of this process.
long process_id();
/// Whether a process of this number is surely over: false where the system does not tell.
bool process_is_over(long id);
/// The file of the running program, links followed; empty where the system does not tell.
std::filesystem::path program_file();

/// Bytes that a program may still take before the system ends one to get more: what is free or can be freed, and within
/// the limit of a container. The largest number where the system does not tell.
std::size_t available_memory();

enum class Stream { In, Err };
/// Whether a person sits at it.
bool is_terminal(Stream);

/// While it lives nothing that is written to the standard error stream is seen, for libraries that write there by
/// themselves. Without effect on Windows.
class QuietErrors {
 public:
  QuietErrors();
  ~QuietErrors();
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  int kept_ = -1;
};

/// Exchanges two names in one step. False, and nothing is changed, where the file system or the system can't.
bool exchange(const std::filesystem::path&, const std::filesystem::path&);

}  // namespace brdfc::inline core
