#include "nodes/conversion/marker_assets.hpp"

#include <stdexcept>
#include <utility>

#include "render/scene/utf8.hpp"

namespace afterglow::nodes {

Converted<render::SharedBody> MarkerAssets::text(const std::string& text, double capital_height) {
  constexpr std::size_t kLongestCharacter = 4;                           // bytes
  const bool hopeless = text.size() > kLongestCharacter * kMostLetters;  // not even decoded
  const std::u32string letters = hopeless ? std::u32string() : render::decodeUtf8(text);
  if (hopeless || letters.size() > kMostLetters) {
    return refused<render::SharedBody>("text of more than 4096 characters");
  }
  try {
    if (!typeface_) typeface_ = std::make_unique<render::Typeface>();
    return {std::make_shared<const render::Body>(typeface_->block(letters, capital_height)), {}};
  } catch (const std::runtime_error& error) {
    return refused<render::SharedBody>(error.what());
  }
}

}  // namespace afterglow::nodes
