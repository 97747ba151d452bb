// SPDX-License-Identifier: GPL-3.0-or-later
// Output folders of commands, and what commands may delete in them.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace brdfc::pack {

/// Throws InputError unless the folder is absent, empty, or written by this tool, because its contents are about to be
/// deleted. A folder counts as written by this tool if its file `mark` contains `text`.
void require_replaceable(const std::filesystem::path& folder, const std::string& mark, const std::string& text);

/// Makes the folder if it does not exist. Throws InputError if that fails.
void make_folder(const std::filesystem::path&);

/// A temporary folder in another one, which is deleted with what is left in it. Those of processes that were killed are
/// deleted before. Throws InputError if it can't be made.
class Staging {
 public:
  explicit Staging(const std::filesystem::path& folder);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Replaces all that a folder contains by files with these texts, by their paths in it. All are written before the
/// first one is replaced, so that a full disk leaves the folder as it was. Throws InputError.
void replace_content(const std::filesystem::path& folder, const std::map<std::string, std::string>& files);

/// Writes a file, after making its folder if that does not exist. Throws InputError if it can't be written.
void write_text(const std::filesystem::path&, const std::string& text);

}  // namespace brdfc::pack
