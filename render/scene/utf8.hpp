/// \file
/// Text from the network.
#pragma once

#include <string>

namespace afterglow::render {

/// Stands for a character that cannot be shown.
constexpr char32_t kReplacement = U'\uFFFD';

/// Decodes UTF-8; every byte that is part of no character (overlong forms, surrogates and what is
/// beyond Unicode among them) becomes a kReplacement.
std::u32string decodeUtf8(const std::string& text);

}  // namespace afterglow::render
