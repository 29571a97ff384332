#include "calib/report/html.hpp"

#include <utf8.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "calib/number_text.hpp"
#include "calib/report/style.hpp"

namespace afterglow::calib {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD

/// As it may stand in a page; of a longer character, each byte stands as it is.
std::string inPage(char letter) {
  switch (letter) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    default:
      const bool is_control = static_cast<unsigned char>(letter) < 0x20 && letter != '\n';
      return is_control ? kReplacement : std::string(1, letter);
  }
}

std::string base64(const std::vector<unsigned char>& bytes) {
  static constexpr char kLetters[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = unsigned(bytes[i]) << 16;
    if (left > 1) group |= unsigned(bytes[i + 1]) << 8;
    if (left > 2) group |= unsigned(bytes[i + 2]);
    text += kLetters[group >> 18];
    text += kLetters[group >> 12 & 63];
    text += left > 1 ? kLetters[group >> 6 & 63] : '=';
    text += left > 2 ? kLetters[group & 63] : '=';
  }
  return text;
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string result;
  for (auto at = text.begin(); at != text.end();) {
    const auto bad = utf8::find_invalid(at, text.end());
    for (; at != bad; ++at) result += inPage(*at);
    if (bad == text.end()) break;
    result += kReplacement;
    ++at;
  }
  return result;
}

std::string element(const std::string& name, const std::string& attributes,
                    const std::string& content) {
  return "<" + name + (attributes.empty() ? "" : " " + attributes) + ">" + content + "</" + name +
         ">";
}

std::string page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta "
         "name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n" +
         element("title", escaped(title)) + "\n<style>" + kReportStyle +
         "</style>\n</head>\n<body>\n<main>\n" + body + "</main>\n</body>\n</html>\n";
}

std::string coordinate(double value) {
  std::string text = fixedText(value, 2);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string point(const Eigen::Vector2d& value) {
  return coordinate(value.x()) + " " + coordinate(value.y());
}

std::string drawing(int width, int height, const std::string& label, const std::string& content) {
  return element("svg",
                 "viewBox=\"-0.5 -0.5 " + std::to_string(width) + " " + std::to_string(height) +
                     "\" role=\"img\" aria-label=\"" + escaped(label) + "\"",
                 content);
}

std::string dataUri(const Picture& picture, int widest) {
  // OpenCV's header wants a mutable pointer; it is only read.
  const cv::Mat whole(picture.height, picture.width, CV_8UC1,
                      const_cast<std::uint8_t*>(picture.pixels.data()));
  cv::Mat small = whole;
  if (picture.width > widest) {
    const int height = std::max(1, picture.height * widest / picture.width);
    cv::resize(whole, small, cv::Size(widest, height), 0, 0, cv::INTER_AREA);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, 80});
  return "data:image/jpeg;base64," + base64(bytes);
}

std::string twoDigits(double value) {
  const int decimals = value < 0.0095  ? 4
                       : value < 0.095 ? 3
                       : value < 0.95  ? 2
                       : value < 9.5   ? 1
                                       : 0;
  return fixedText(value, decimals);
}

double roundDown(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  const double lead = value / power;
  return (lead >= 5 ? 5 : lead >= 2 ? 2 : 1) * power;
}

double quantile(std::vector<double> errors, double share) {
  if (errors.empty()) return 0;
  const auto at = std::min(errors.size() - 1,
                           static_cast<std::size_t>(share * static_cast<double>(errors.size())));
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(at), errors.end());
  return errors[at];
}

}  // namespace afterglow::calib
