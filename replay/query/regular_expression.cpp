#include "replay/query/regular_expression.hpp"

#define PCRE2_CODE_UNIT_WIDTH 8
#include <pcre2.h>

#include <array>
#include <cstdint>

namespace afterglow::replay {
namespace {

/// Steps of the matcher; about 10 ms.
constexpr std::uint32_t kMostSteps = 1'000'000;
constexpr std::uint32_t kMostMemory_KiB = 20'000;
/// The length of an expression itself, in bytes: compiling takes time and memory, too.
constexpr std::size_t kLongestPattern = 10'000;

using MatchData = std::unique_ptr<pcre2_match_data, void (*)(pcre2_match_data*)>;

PCRE2_SPTR lettersOf(const std::string& text) { return reinterpret_cast<PCRE2_SPTR>(text.data()); }

std::uint32_t flagsOf(const std::string& letters) {
  std::uint32_t flags = PCRE2_UTF | PCRE2_MATCH_INVALID_UTF;
  for (const char letter : letters) {
    if (letter == 'i') flags |= PCRE2_CASELESS;
    if (letter == 'm') flags |= PCRE2_MULTILINE;
    if (letter == 's') flags |= PCRE2_DOTALL;
    if (letter == 'x') flags |= PCRE2_EXTENDED;
  }
  return flags;
}

/// Null: no match. `flags`: of pcre2_match.
MatchData matchOf(const void* compiled, const std::string& pattern, const std::string& text,
                  std::uint32_t flags) {
  const auto* code = static_cast<const pcre2_code*>(compiled);
  MatchData match(pcre2_match_data_create_from_pattern(code, nullptr), pcre2_match_data_free);
  const std::unique_ptr<pcre2_match_context, void (*)(pcre2_match_context*)> context(
      pcre2_match_context_create(nullptr), pcre2_match_context_free);
  pcre2_set_match_limit(context.get(), kMostSteps);
  pcre2_set_heap_limit(context.get(), kMostMemory_KiB);
  const int found =
      pcre2_match(code, lettersOf(text), text.size(), 0, flags, match.get(), context.get());
  if (found == PCRE2_ERROR_MATCHLIMIT || found == PCRE2_ERROR_DEPTHLIMIT ||
      found == PCRE2_ERROR_HEAPLIMIT) {
    throw RegularExpression::TooLong("'" + pattern +
                                     "' takes too long; are repetitions nested in it?");
  }
  return found >= 0 ? std::move(match) : MatchData(nullptr, pcre2_match_data_free);
}

}  // namespace

RegularExpression::RegularExpression(const std::string& pattern, const std::string& letters)
    : pattern_(pattern) {
  if (pattern.size() > kLongestPattern) {
    pattern_.resize(40);
    throw std::invalid_argument("at character " + std::to_string(kLongestPattern) +
                                ": longer than that");
  }
  int error = 0;
  PCRE2_SIZE at = 0;
  pcre2_code* code = pcre2_compile(lettersOf(pattern), pattern.size(), flagsOf(letters), &error,
                                   &at, nullptr);
  if (!code) {
    std::array<PCRE2_UCHAR, 256> text{};
    pcre2_get_error_message(error, text.data(), text.size());
    throw std::invalid_argument("at character " + std::to_string(at) + ": " +
                                reinterpret_cast<const char*>(text.data()));
  }
  code_.reset(code, [](void* compiled) { pcre2_code_free(static_cast<pcre2_code*>(compiled)); });
}

RegularExpression RegularExpression::ofNames(const std::string& pattern) {
  try {
    return RegularExpression(pattern);
  } catch (const std::invalid_argument& error) {
    const bool is_long = pattern.size() > 100;
    throw std::invalid_argument("'" + pattern.substr(0, 100) + (is_long ? "..." : "") +
                                "' is no regular expression: " + error.what());
  }
}

bool RegularExpression::isIn(const std::string& text) const {
  return matchOf(code_.get(), pattern_, text, 0) != nullptr;
}

bool RegularExpression::isWhole(const std::string& text) const {
  return matchOf(code_.get(), pattern_, text, PCRE2_ANCHORED | PCRE2_ENDANCHORED) != nullptr;
}

std::vector<std::string> RegularExpression::groups(const std::string& text) const {
  const MatchData match =
      matchOf(code_.get(), pattern_, text, PCRE2_ANCHORED | PCRE2_ENDANCHORED);
  if (!match) return {};
  const PCRE2_SIZE* const places = pcre2_get_ovector_pointer(match.get());
  std::vector<std::string> groups(pcre2_get_ovector_count(match.get()));
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (places[2 * i] == PCRE2_UNSET) continue;
    groups[i] = text.substr(places[2 * i], places[2 * i + 1] - places[2 * i]);
  }
  return groups;
}

}  // namespace afterglow::replay
