// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/zip.h"

#include <archive.h>
#include <archive_entry.h>

#include <memory>

#include "core/error.h"

namespace brdfc::pack {
namespace {

struct ArchiveDelete {
  void operator()(archive* a) const { archive_write_free(a); }
};

}  // namespace

void write_zip(const std::filesystem::path& path, const std::map<std::string, std::string>& members) {
  const std::unique_ptr<archive, ArchiveDelete> zip(archive_write_new());
  const auto require = [&](int status) {
    if (status != ARCHIVE_OK) input_error("{}: cannot be written: {}", path.string(), archive_error_string(zip.get()));
  };
  require(archive_write_set_format_zip(zip.get()));
  require(archive_write_open_filename(zip.get(), path.c_str()));
  for (const auto& [name, data] : members) {
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(), archive_entry_free);
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(data.size()));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    archive_entry_set_mtime(entry.get(), 1577836800, 0);  // 2020-01-01
    require(archive_write_header(zip.get(), entry.get()));
    if (archive_write_data(zip.get(), data.data(), data.size()) != la_ssize_t(data.size()))
      input_error("{}: cannot be written: {}", path.string(), archive_error_string(zip.get()));
  }
  require(archive_write_close(zip.get()));
}

}  // namespace brdfc::pack
