// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/process.h"

#define BOOST_DLL_USE_STD_FS
#include <algorithm>
#include <boost/dll/runtime_symbol_info.hpp>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string>

#include "core/error.h"

#ifdef _WIN32
#include <io.h>
#include <process.h>
#else
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <unistd.h>

#include <cerrno>
#endif

namespace brdfc::inline core {

namespace fs = std::filesystem;

#ifdef _WIN32
long process_id() { return _getpid(); }
bool process_is_over(long) { return false; }
bool is_terminal(Stream stream) { return _isatty(stream == Stream::In ? 0 : 2); }
QuietErrors::QuietErrors() = default;
QuietErrors::~QuietErrors() = default;
#else
long process_id() { return getpid(); }
bool process_is_over(long id) { return id > 0 && kill(pid_t(id), 0) != 0 && errno == ESRCH; }
bool is_terminal(Stream stream) { return isatty(stream == Stream::In ? STDIN_FILENO : STDERR_FILENO); }

QuietErrors::QuietErrors() {
  fflush(stderr);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  kept_ = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0);
  if (kept_ >= 0) dup2(nowhere, STDERR_FILENO);
  close(nowhere);
}

QuietErrors::~QuietErrors() {
  if (kept_ < 0) return;
  fflush(stderr);
  dup2(kept_, STDERR_FILENO);
  close(kept_);
}

void* load_symbol(const fs::path& library, const char* symbol) {
  // Functions of the libraries behind it are looked up when they are called, as at the start of a program.
  void* const loaded = dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  void* const address = loaded ? dlsym(loaded, symbol) : nullptr;
  if (!address) {
    const char* const reason = dlerror();
    input_error("{} can't be loaded: {}", library.string(), reason ? reason : "an empty symbol");
  }
  return address;
}
#endif

fs::path program_file() {
  std::error_code error;
  const fs::path program = boost::dll::program_location(error);
  return error ? fs::path() : fs::weakly_canonical(program, error);
}

std::size_t available_memory() {
  constexpr std::size_t unknown = std::numeric_limits<std::size_t>::max();
  /// The sum of the numbers that follow these keys, each key at the start of a line.
  const auto sum_of = [](const char* file, std::initializer_list<const char*> keys) {
    std::size_t sum = 0, number;
    std::ifstream in(file);
    for (std::string line, key; std::getline(in, line);) {
      std::istringstream words(line);
      if (words >> key >> number && std::find(keys.begin(), keys.end(), key) != keys.end()) sum += number;
    }
    return sum;
  };
  const auto number_in = [](const char* file) {
    std::size_t number;
    return std::ifstream(file) >> number ? number : unknown;
  };
  std::size_t available = unknown;
  if (const std::size_t kibibytes = sum_of("/proc/meminfo", {"MemAvailable:", "SwapFree:"}))
    available = kibibytes * 1024;
  const std::size_t limit = number_in("/sys/fs/cgroup/memory.max"), used = number_in("/sys/fs/cgroup/memory.current");
  if (limit != unknown && used != unknown) {
    // The file cache counts as used memory, but the kernel frees it on demand.
    const std::size_t free = limit > used ? limit - used : 0;
    available = std::min(available, free + sum_of("/sys/fs/cgroup/memory.stat", {"active_file", "inactive_file"}));
  }
  return available;
}

bool exchange([[maybe_unused]] const fs::path& a, [[maybe_unused]] const fs::path& b) {
#ifdef RENAME_EXCHANGE
  return renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0;
#else
  return false;
#endif
}

}  // namespace brdfc::inline core
