// SPDX-License-Identifier: GPL-3.0-or-later
// Picture files as plain data, and the library behind them.
#include "pictures/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include "core/error.h"
#include "pictures/library.h"
#include "support.h"

namespace brdfc::pictures {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The message of the InputError that f throws.
template <class F> std::string refusal(const F& f) {
  try {
    f();
  } catch (const InputError& e) {
    return e.what();
  }
  return "no InputError";
}

TEST(Pictures, FloatsNamesAndAttributesComeBack) {
  const TempFolder folder;
  const auto path = folder.path() / "a.exr";
  Header header{3, 2};
  header.channels = {"R", "G", "B", "variance.R"};
  header.attributes = {{"test:text", "a text"},
                       {"test:integer", 7},
                       {"test:number", 0.25f},
                       {"test:numbers", std::vector<float>{1, 2, 3, 4, 5}}};
  std::vector<float> pixels(3 * 2 * 4);
  std::iota(pixels.begin(), pixels.end(), -1.5f);
  EXPECT_FALSE(write(path, header, pixels));

  std::string reason;
  const auto in = open(path, reason);
  ASSERT_TRUE(in) << reason;
  const Header& found = in->header();
  EXPECT_EQ(found.width, 3);
  EXPECT_EQ(found.height, 2);
  EXPECT_TRUE(found.floating);
  EXPECT_THAT(found.channels, ElementsAre("R", "G", "B", "variance.R"));
  EXPECT_EQ(found.text("test:text"), "a text");
  EXPECT_EQ(found.text("TEST:Text"), "a text");
  EXPECT_EQ(found.text("test:integer"), "");
  EXPECT_EQ(found.numbers("test:numbers", 5), (std::vector<float>{1, 2, 3, 4, 5}));
  EXPECT_EQ(found.numbers("test:numbers", 4), std::nullopt);
  EXPECT_EQ(found.numbers("test:text", 1), std::nullopt);
  const auto value = [&](const std::string& name) {
    for (const Attribute& a : found.attributes)
      if (a.name == name) return a.value;
    return decltype(Attribute::value)(std::string("missing"));
  };
  EXPECT_EQ(std::get<int>(value("test:integer")), 7);
  EXPECT_EQ(std::get<float>(value("test:number")), 0.25f);
  std::vector<float> same(pixels.size());
  EXPECT_EQ(in->read(same.data()), std::nullopt);
  EXPECT_EQ(same, pixels);
}

TEST(Pictures, BytesAreNumbersUpToOne) {
  const TempFolder folder;
  Header header{2, 1};
  header.channels = {"", "", ""};
  header.floating = false;
  const std::vector<unsigned char> bytes{0, 51, 255, 102, 153, 204};
  std::vector<float> numbers;
  for (const unsigned char b : bytes) numbers.push_back(float(b) / 255);
  EXPECT_FALSE(write(folder.path() / "bytes.png", header, bytes));
  EXPECT_FALSE(write(folder.path() / "numbers.png", header, numbers));
  for (const char* name : {"bytes.png", "numbers.png"}) {
    std::string reason;
    const auto in = open(folder.path() / name, reason, "png");
    ASSERT_TRUE(in) << reason;
    EXPECT_FALSE(in->header().floating);
    EXPECT_THAT(in->header().channels, ElementsAre("R", "G", "B"));
    std::vector<float> found(bytes.size());
    EXPECT_EQ(in->read(found.data()), std::nullopt);
    EXPECT_THAT(found, testing::Pointwise(testing::FloatEq(), numbers));  // OpenImageIO multiplies by 1 / 255
  }
}

TEST(Pictures, ErrorsOfTheLibraryAreReturned) {
  const TempFolder folder;
  const auto path = folder.path() / "a.exr";
  Header header{64, 64};
  header.channels = {"R", "G", "B"};
  std::vector<float> pixels(3 * 64 * 64, 0.5f);
  ASSERT_FALSE(write(path, header, pixels));

  // OpenEXR throws exceptions of its own at a header or pixels that end too early.
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 20);
  std::string reason;
  if (const auto in = open(path, reason)) {
    EXPECT_THAT(in->read(pixels.data()), testing::Optional(testing::Not("")));
  } else {
    EXPECT_NE(reason, "");
  }
  std::filesystem::resize_file(path, 40);
  for (const char* format : {"", "exr"}) {
    reason.clear();
    EXPECT_EQ(open(path, reason, format), nullptr);
    EXPECT_NE(reason, "");
  }
  EXPECT_EQ(open(path, reason, "unheard-of"), nullptr);
  EXPECT_THAT(reason, HasSubstr("unheard-of"));

  const auto unknown = write(folder.path() / "a.unheard-of", header, pixels);
  ASSERT_TRUE(unknown);
  EXPECT_TRUE(unknown->unknown_format);
  EXPECT_THAT(unknown->reason, HasSubstr("unheard-of"));
  const auto nowhere = write(folder.path() / "no" / "folder" / "a.exr", header, pixels);
  ASSERT_TRUE(nowhere);
  EXPECT_FALSE(nowhere->unknown_format);
  EXPECT_NE(nowhere->reason, "");
}

TEST(Pictures, FewerPixelsThanTheHeaderSaysAreRefused) {
  Header header{4, 4};
  header.channels = {"R", "G", "B"};
  EXPECT_THROW(static_cast<void>(write("a.exr", header, std::vector<float>(47))), std::logic_error);
}

TEST(Pictures, AModuleThatCannotBeLoadedIsNamedWithTheReason) {
  const TempFolder folder;
  const auto module = folder.path() / "module.so";
  EXPECT_THAT(refusal([&] { load(module); }), testing::AllOf(HasSubstr(module.string()), HasSubstr("No such file")));
  std::ofstream(module) << "no library";
  EXPECT_THAT(refusal([&] { load(module); }), testing::AllOf(HasSubstr(module.string()), HasSubstr("too short")));
  // Another library, which does not have the module's symbol.
  EXPECT_THAT(refusal([&] { load("libm.so.6"); }), HasSubstr("brdfc_pictures_library"));
}

}  // namespace
}  // namespace brdfc::pictures
