#include "nodes/conversion/marker_assets.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "render/scene/utf8.hpp"

namespace afterglow::nodes {
namespace {

/// Names the first of the characters that are missing.
std::string remarkOn(const std::u32string& missing) {
  if (missing.empty()) return {};
  const auto first = static_cast<std::uint32_t>(missing.front());
  return fmt::format(
      "no font has U+{:04X}{}: install one that has (fonts-noto-core, fonts-noto-cjk, "
      "fonts-symbola)",
      first, missing.size() > 1 ? fmt::format(" and {} more", missing.size() - 1) : "");
}

}  // namespace

Converted<render::SharedBody> MarkerAssets::text(const std::string& text, double capital_height) {
  const auto known = texts_.find({text, capital_height});
  if (known != texts_.end()) {
    if (auto letters = known->second.letters.lock()) {
      return {std::move(letters), known->second.remark};
    }
  }
  constexpr std::size_t kLongestCharacter = 4;                           // bytes
  const bool hopeless = text.size() > kLongestCharacter * kMostLetters;  // too many letters
  const std::u32string letters = hopeless ? std::u32string() : render::decodeUtf8(text);
  if (hopeless || letters.size() > kMostLetters) {
    return refused<render::SharedBody>("text of more than 4096 characters");
  }
  try {
    if (!typeface_) typeface_ = std::make_unique<render::Typeface>();
    render::TextBlock block = typeface_->set(letters, capital_height);
    const std::string remark = remarkOn(block.missing);
    auto body = std::make_shared<const render::Body>(std::move(block.letters));
    texts_.insert_or_assign({text, capital_height}, Known{body, remark});
    if (texts_.size() >= sweep_at_) forgetUnseen();
    return {std::move(body), remark};
  } catch (const std::runtime_error& error) {
    return refused<render::SharedBody>(error.what());
  }
}

void MarkerAssets::forgetUnseen() {
  for (auto it = texts_.begin(); it != texts_.end();) {
    it = it->second.letters.expired() ? texts_.erase(it) : std::next(it);
  }
  sweep_at_ = 2 * texts_.size() + 64;
}

}  // namespace afterglow::nodes
