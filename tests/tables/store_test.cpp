// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <set>

#include "core/data_dir.h"
#include "fit/settings.h"
#include "measure/albedo_settings.h"
#include "support.h"

namespace brdfc {
namespace {

using testing::HasSubstr;

/// Hashes of keys of settings of which one word is another, and of those as they are.
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

/// The tool's data in a folder of the test.
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
  testing::internal::CaptureStderr();
  EXPECT_EQ(find_stored(key, "fit of phong", "a minute"), std::nullopt);
  EXPECT_THAT(
      testing::internal::GetCapturedStderr(),
      HasSubstr(fmt::format("no fit of phong in {}/data/fits: making it, which takes a minute", data.path().string())));
  const auto write = [](const std::filesystem::path& path) { std::ofstream(path) << "kept"; };
  replace_stored(old, write);
  replace_stored(other, write);
  EXPECT_TRUE(find_stored(old, "", ""));
  replace_stored(key, write);
  testing::internal::CaptureStderr();
  EXPECT_EQ(find_stored(key, "", ""), key.path());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_FALSE(std::filesystem::exists(old.path()));
  EXPECT_TRUE(std::filesystem::exists(other.path())) << "a model whose name begins alike";
}

}  // namespace
}  // namespace brdfc
