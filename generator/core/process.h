// SPDX-License-Identifier: GPL-3.0-or-later
// Processes, terminals and files: everything that differs between Linux, macOS and Windows.
#pragma once

#include <cstddef>
#include <filesystem>

namespace brdfc::inline core {

/// The id of this process.
long process_id();
/// True if the process with this id has certainly ended; false if the system does not tell.
bool process_is_over(long id);
/// The running program's file, with links resolved; empty if the system does not tell.
std::filesystem::path program_file();

/// Bytes that a program may still allocate before the system ends a program for lack of memory: memory that is free or
/// can be freed, within the limit of a container. The largest number if the system does not tell.
std::size_t available_memory();

enum class Stream { In, Err };
/// Whether the stream is a terminal.
bool is_terminal(Stream);

/// Hides everything that is written to the standard error stream during its lifetime, for libraries that print there by
/// themselves. It has no effect on Windows.
class QuietErrors {
 public:
  QuietErrors();
  ~QuietErrors();
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  int kept_ = -1;
};

/// The address of a symbol of a shared library, which stays loaded until the program ends. Throws InputError that names
/// the library and gives the loader's reason. Not on Windows.
void* load_symbol(const std::filesystem::path& library, const char* symbol);

/// Exchanges two file names atomically. Returns false, and changes nothing, if the file system or the operating system
/// can't do that.
bool exchange(const std::filesystem::path&, const std::filesystem::path&);

}  // namespace brdfc::inline core
