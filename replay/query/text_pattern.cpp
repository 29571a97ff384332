#include "replay/query/text_pattern.hpp"

#include "replay/query/filter.hpp"

namespace afterglow::replay {
namespace {

RegularExpression compiled(const std::string& pattern, const std::string& options) {
  const auto unknown = options.find_first_not_of("imsx");
  if (unknown != std::string::npos) {
    throw FilterError(std::string("$options knows i, m, s and x, not \"") + options[unknown] + "\"");
  }
  try {
    return RegularExpression(pattern, options);
  } catch (const std::invalid_argument& error) {
    throw FilterError("$regex \"" + pattern + "\", " + error.what());
  }
}

}  // namespace

TextPattern::TextPattern(const std::string& pattern, const std::string& options)
    : pattern_(pattern), expression_(compiled(pattern, options)) {}

bool TextPattern::isIn(const std::string& text) const {
  try {
    return expression_.isIn(text);
  } catch (const RegularExpression::TooLong&) {
    throw FilterError("$regex \"" + pattern_ + "\" takes too long; are repetitions nested in it?");
  }
}

}  // namespace afterglow::replay
