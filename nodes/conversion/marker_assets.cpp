#include "nodes/conversion/marker_assets.hpp"

#include <iterator>
#include <stdexcept>
#include <utility>

#include "render/scene/utf8.hpp"

namespace afterglow::nodes {

Converted<render::SharedBody> MarkerAssets::text(const std::string& text, double capital_height) {
  const auto known = texts_.find({text, capital_height});
  if (known != texts_.end()) {
    if (auto letters = known->second.lock()) return {std::move(letters), {}};
  }
  constexpr std::size_t kLongestCharacter = 4;                           // bytes
  const bool hopeless = text.size() > kLongestCharacter * kMostLetters;  // too many letters
  const std::u32string letters = hopeless ? std::u32string() : render::decodeUtf8(text);
  if (hopeless || letters.size() > kMostLetters) {
    return refused<render::SharedBody>("text of more than 4096 characters");
  }
  try {
    if (!typeface_) typeface_ = std::make_unique<render::Typeface>();
    auto body = std::make_shared<const render::Body>(typeface_->block(letters, capital_height));
    texts_.insert_or_assign({text, capital_height}, body);
    if (texts_.size() >= sweep_at_) forgetUnseen();
    return {std::move(body), {}};
  } catch (const std::runtime_error& error) {
    return refused<render::SharedBody>(error.what());
  }
}

void MarkerAssets::forgetUnseen() {
  for (auto it = texts_.begin(); it != texts_.end();) {
    it = it->second.expired() ? texts_.erase(it) : std::next(it);
  }
  sweep_at_ = 2 * texts_.size() + 64;
}

}  // namespace afterglow::nodes
