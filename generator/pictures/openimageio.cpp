// SPDX-License-Identifier: GPL-3.0-or-later
// The only source that calls OpenImageIO's library of file formats: the whole of the module, if it is one.
#include <OpenImageIO/imageio.h>

#include <algorithm>

#include "pictures/library.h"

namespace brdfc::pictures {

namespace fs = std::filesystem;

namespace {

Header header_of(const OIIO::ImageSpec& spec) {
  Header header{spec.width, spec.height, spec.depth, spec.channelnames, spec.format.is_floating_point()};
  header.channels.resize(std::size_t(std::max(spec.nchannels, 0)));
  for (const OIIO::ParamValue& a : spec.extra_attribs) {
    const std::string name = a.name().string();
    const OIIO::TypeDesc type = a.type();
    if (type == OIIO::TypeDesc::STRING) {
      header.attributes.push_back({name, a.get_string()});
    } else if (type == OIIO::TypeDesc::INT) {
      header.attributes.push_back({name, a.get_int()});
    } else if (type == OIIO::TypeDesc::FLOAT) {
      header.attributes.push_back({name, a.get_float()});
    } else {
      std::vector<float> numbers(type.numelements() * type.aggregate);
      if (spec.getattribute(name, OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, int(numbers.size())), numbers.data()))
        header.attributes.push_back({name, std::move(numbers)});
    }
  }
  return header;
}

OIIO::ImageSpec spec_of(const Header& header) {
  OIIO::ImageSpec spec(header.width, header.height, int(header.channels.size()),
                       header.floating ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8);
  for (std::size_t i = 0; i < header.channels.size(); ++i)
    if (!header.channels[i].empty()) spec.channelnames[i] = header.channels[i];
  for (const Attribute& a : header.attributes)
    if (const auto* text = std::get_if<std::string>(&a.value))
      spec.attribute(a.name, *text);
    else if (const auto* numbers = std::get_if<std::vector<float>>(&a.value))
      spec.attribute(a.name, OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, int(numbers->size())), numbers->data());
    else if (const auto* number = std::get_if<int>(&a.value))
      spec.attribute(a.name, *number);
    else
      spec.attribute(a.name, std::get<float>(a.value));
  return spec;
}

class OiioReader : public Reader {
 public:
  OiioReader(std::unique_ptr<OIIO::ImageInput> in, const OIIO::ImageSpec& spec)
      : in_(std::move(in)), header_(header_of(spec)) {}
  const Header& header() const override { return header_; }
  std::optional<std::string> read(float* pixels) override {
    if (in_->read_image(0, 0, 0, int(header_.channels.size()), OIIO::TypeDesc::FLOAT, pixels)) return std::nullopt;
    return in_->geterror();
  }

 private:
  std::unique_ptr<OIIO::ImageInput> in_;
  Header header_;
};

class OiioLibrary : public Library {
 public:
  std::unique_ptr<Reader> open(const fs::path& path, std::string& reason, const std::string& format) const override {
    OIIO::ImageSpec spec;
    auto in = format.empty() ? OIIO::ImageInput::open(path.string()) : OIIO::ImageInput::create(format);
    if (!in) {
      reason = OIIO::geterror();
      return nullptr;
    }
    if (format.empty()) {
      spec = in->spec();
    } else if (!in->open(path.string(), spec)) {
      reason = in->geterror();
      return nullptr;
    }
    // Cycles multiplies colours by an alpha that is not in them yet, but not what has one channel.
    if (spec.nchannels == 2 && spec.alpha_channel == 1) {
      OIIO::ImageSpec as_stored;
      as_stored.attribute("oiio:UnassociatedAlpha", 1);
      in->close();
      if (!in->open(path.string(), spec, as_stored)) {
        reason = in->geterror();
        return nullptr;
      }
    }
    return std::make_unique<OiioReader>(std::move(in), spec);
  }

  std::optional<WriteError> write(const fs::path& path, const Header& header, const float* pixels) const override {
    return write(path, header, OIIO::TypeDesc::FLOAT, pixels);
  }
  std::optional<WriteError> write(const fs::path& path, const Header& header,
                                  const unsigned char* pixels) const override {
    return write(path, header, OIIO::TypeDesc::UINT8, pixels);
  }

 private:
  static std::optional<WriteError> write(const fs::path& path, const Header& header, OIIO::TypeDesc type,
                                         const void* pixels) {
    const auto out = OIIO::ImageOutput::create(path.string());
    if (!out) return WriteError{true, OIIO::geterror()};
    if (!out->open(path.string(), spec_of(header)) || !out->write_image(type, pixels) || !out->close())
      return WriteError{false, out->geterror()};
    return std::nullopt;
  }
};

}  // namespace
}  // namespace brdfc::pictures

extern "C" const brdfc::pictures::Library* brdfc_pictures_library() {
  static const brdfc::pictures::OiioLibrary library;
  return &library;
}
