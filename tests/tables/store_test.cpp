// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>

#include "core/data_dir.h"
#include "environment.h"
#include "fit/settings.h"
#include "measure/albedo_settings.h"
#include "support.h"

namespace brdfc {
namespace {

using testing::HasSubstr;

/// Hashes of the unchanged settings, and of settings with one word changed.
template <class Settings> std::set<std::string> variants(const Settings& settings) {
  std::set<std::string> hashes = {StoreKey("fits", "phong").add_settings(settings).hash()};
  for (std::size_t i = 0; i < sizeof(Settings) / 8; ++i) {
    auto words = words_of(settings);
    ++words[i];
    hashes.insert(StoreKey("fits", "phong").add_settings(std::bit_cast<Settings>(words)).hash());
  }
  return hashes;
}

TEST(Store, EverySettingIsInTheKey) {
  struct Settings {
    std::size_t count = 3;
    double share = 0.5;
    std::array<double, 2> shape = {1, 2};
  };
  EXPECT_EQ(variants(Settings()).size(), 5u);
  EXPECT_EQ(variants(fit::kSettings).size(), 1 + sizeof(fit::kSettings) / 8);
  EXPECT_EQ(variants(fit::kViewSettings).size(), 1 + sizeof(fit::kViewSettings) / 8);
  EXPECT_EQ(variants(measure::kTableSettings).size(), 1 + sizeof(measure::kTableSettings) / 8);
  Settings changed;
  changed.share = 0.5 + 1e-15;
  EXPECT_NE(StoreKey("fits", "phong").add_settings(Settings()).hash(),
            StoreKey("fits", "phong").add_settings(changed).hash());
}

TEST(Store, KindModelAndPartsAreInTheKey) {
  const std::string hash = StoreKey("fits", "phong").add("a", "1").hash();
  EXPECT_EQ(hash, StoreKey("fits", "phong").add("a", "1").hash());
  for (const StoreKey& other : {StoreKey("albedos", "phong").add("a", "1"), StoreKey("fits", "blinn").add("a", "1"),
                                StoreKey("fits", "phong").add("b", "1"), StoreKey("fits", "phong").add("a", "2")})
    EXPECT_NE(hash, other.hash());
}

/// The tool's data, in a folder of the test.
class OwnData {
 public:
  OwnData() {
    const std::filesystem::path sign = std::filesystem::relative(sign_, data_dir());
    std::filesystem::create_directories(folder_.path() / sign.parent_path());
    std::filesystem::copy_file(sign_, folder_.path() / sign);
    setenv("BRDFC_DATA", folder_.path().c_str(), 1);
  }
  ~OwnData() { unsetenv("BRDFC_DATA"); }
  std::filesystem::path path() const { return folder_.path(); }

 private:
  const std::filesystem::path sign_ = data_dir() / "blender_addon" / "blender_manifest.toml";
  TempFolder folder_;
};

TEST(Store, SaysWhatItHasNotAndReplacesWhatIsOld) {
  const OwnData data;
  const StoreKey key = StoreKey("fits", "phong").add("a", "1"), old = StoreKey("fits", "phong").add("a", "0"),
                 other = StoreKey("fits", "phong_material").add("a", "0");
  EXPECT_EQ(find_stored(key), std::nullopt);
  testing::internal::CaptureStderr();
  announce_making(key, "fit of phong", "a minute");
  EXPECT_THAT(
      testing::internal::GetCapturedStderr(),
      HasSubstr(fmt::format("no fit of phong in {}/data/fits: making it, which takes a minute", data.path().string())));
  const auto write = [](const std::filesystem::path& path) { std::ofstream(path) << "kept"; };
  replace_stored(old, write);
  replace_stored(other, write);
  EXPECT_TRUE(find_stored(old));
  replace_stored(key, write);
  EXPECT_EQ(find_stored(key), key.path());
  EXPECT_FALSE(std::filesystem::exists(old.path()));
  EXPECT_TRUE(std::filesystem::exists(other.path())) << "a model whose name begins alike";
}

/// A result that is a word, and the number of times it was made.
struct Word {
  int made = 0;

  std::string operator()(const StoreKey& key) {
    return kept_or_made(
        key, "word", "a moment",
        [](const std::filesystem::path& path) {
          std::string word;
          if (!(std::ifstream(path) >> word)) input_error("{}: expected a word", path.string());
          return word;
        },
        [&] {
          ++made;
          return std::string("new");
        },
        [](const std::string& word, const std::filesystem::path& path) { std::ofstream(path) << word; });
  }
};

TEST(Store, KeepsInTheCacheWhatTheDataLack) {
  const OwnData data;
  const TempFolder folder;
  const Environment environment("BRDFC_CACHE", (folder.path() / "cache").string());
  const StoreKey key = StoreKey("fits", "own").add("a", "1");
  Word word;
  testing::internal::CaptureStderr();
  EXPECT_EQ(word(key), "new");
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("making it, which takes a moment"));
  testing::internal::CaptureStderr();
  EXPECT_EQ(word(key), "new");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "nothing is made, and nothing is said";
  EXPECT_EQ(word.made, 1);
  // Damaged: made again.
  std::ofstream(*key.cached_path(), std::ios::trunc).close();
  EXPECT_EQ(word(key), "new");
  EXPECT_EQ(word.made, 2);
  EXPECT_EQ(word(key), "new");
  EXPECT_EQ(word.made, 2);
  // The installed data takes precedence, and a damaged file in it is an error.
  replace_stored(key, [](const std::filesystem::path& path) { std::ofstream(path) << "kept"; });
  EXPECT_EQ(word(key), "kept");
  std::ofstream(key.path(), std::ios::trunc).close();
  EXPECT_THROW(word(key), InputError);
}
TEST(Store, TheCacheKeepsThoseThatWereUsedLast) {
  const OwnData data;
  const TempFolder folder;
  const Environment environment("BRDFC_CACHE", folder.path().string());
  const auto key = [](int i) { return StoreKey("fits", "own").add("a", std::to_string(i)); };
  Word word;
  testing::internal::CaptureStderr();
  for (int i = 0; i < 16; ++i) {
    word(key(i));
    std::filesystem::last_write_time(*key(i).cached_path(),
                                     std::filesystem::file_time_type::clock::now() - std::chrono::hours(100 - i));
  }
  word(key(0));  // is used again
  word(key(16));
  testing::internal::GetCapturedStderr();
  EXPECT_EQ(word.made, 17);
  EXPECT_TRUE(find_cached(key(0)));
  EXPECT_FALSE(find_cached(key(1)));
  EXPECT_TRUE(find_cached(key(2)));
  EXPECT_TRUE(find_cached(key(16)));
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "fits"))
    EXPECT_TRUE(entry.path().filename().string().starts_with("own_")) << entry.path();
}
TEST(Store, WithoutACacheEverythingIsMade) {
  const OwnData data;
  const TempFolder folder;
  const StoreKey key = StoreKey("fits", "own").add("a", "1");
  Word word;
  testing::internal::CaptureStderr();
  {
    const Environment environment("BRDFC_CACHE", "");
    word(key);
    word(key);
  }
  std::ofstream(folder.path() / "file").close();
  const Environment environment("BRDFC_CACHE", (folder.path() / "file").string());
  EXPECT_EQ(word(key), "new") << "a place that takes no files is no error";
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("it is not kept for the next time"));
  EXPECT_EQ(word.made, 3);
}

}  // namespace
}  // namespace brdfc
