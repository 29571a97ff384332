#include "replay/query/text_pattern.hpp"

#define PCRE2_CODE_UNIT_WIDTH 8
#include <pcre2.h>

#include <array>

#include "replay/query/filter.hpp"

namespace afterglow::replay {
namespace {

/// Steps of the matcher; about 10 ms.
constexpr std::uint32_t kMostSteps = 1'000'000;

PCRE2_SPTR letters(const std::string& text) { return reinterpret_cast<PCRE2_SPTR>(text.data()); }

std::uint32_t flagsOf(const std::string& options) {
  std::uint32_t flags = PCRE2_UTF | PCRE2_MATCH_INVALID_UTF;
  for (const char option : options) {
    switch (option) {
      case 'i':
        flags |= PCRE2_CASELESS;
        break;
      case 'm':
        flags |= PCRE2_MULTILINE;
        break;
      case 's':
        flags |= PCRE2_DOTALL;
        break;
      case 'x':
        flags |= PCRE2_EXTENDED;
        break;
      default:
        throw FilterError(std::string("$options knows i, m, s and x, not \"") + option + "\"");
    }
  }
  return flags;
}

}  // namespace

TextPattern::TextPattern(const std::string& pattern, const std::string& options)
    : pattern_(pattern) {
  int error = 0;
  PCRE2_SIZE at = 0;
  pcre2_code* code =
      pcre2_compile(letters(pattern), pattern.size(), flagsOf(options), &error, &at, nullptr);
  if (!code) {
    std::array<PCRE2_UCHAR, 256> text{};
    pcre2_get_error_message(error, text.data(), text.size());
    throw FilterError("$regex \"" + pattern + "\", at character " + std::to_string(at) + ": " +
                      reinterpret_cast<const char*>(text.data()));
  }
  code_.reset(code, [](void* compiled) { pcre2_code_free(static_cast<pcre2_code*>(compiled)); });
}

bool TextPattern::isIn(const std::string& text) const {
  const auto* code = static_cast<const pcre2_code*>(code_.get());
  const std::unique_ptr<pcre2_match_data, void (*)(pcre2_match_data*)> match(
      pcre2_match_data_create_from_pattern(code, nullptr), pcre2_match_data_free);
  const std::unique_ptr<pcre2_match_context, void (*)(pcre2_match_context*)> context(
      pcre2_match_context_create(nullptr), pcre2_match_context_free);
  pcre2_set_match_limit(context.get(), kMostSteps);
  const int found = pcre2_match(code, letters(text), text.size(), 0, 0, match.get(), context.get());
  if (found == PCRE2_ERROR_MATCHLIMIT || found == PCRE2_ERROR_DEPTHLIMIT ||
      found == PCRE2_ERROR_HEAPLIMIT) {
    throw FilterError("$regex \"" + pattern_ + "\" takes too long; are repetitions nested in it?");
  }
  return found >= 0;
}

}  // namespace afterglow::replay
