/// \file
/// Pieces of the report's page. What they write is well-formed XML too, so that a test can check
/// it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/picture.hpp"

namespace afterglow::calib {

/// For text and for attributes in double quotes. Control characters, which no page may hold, become
/// U+FFFD, and so do bytes that are no UTF-8.
std::string escaped(const std::string& text);

/// <name attributes>content</name>; the content is markup already.
std::string element(const std::string& name, const std::string& attributes,
                    const std::string& content);
inline std::string element(const std::string& name, const std::string& content) {
  return element(name, "", content);
}

/// A table's cell that holds a number.
inline std::string numberCell(const std::string& content) {
  return element("td", "class=\"n\"", content);
}

/// A whole page with the report's style. The title is plain text.
std::string page(const std::string& title, const std::string& body);

/// A coordinate in an SVG: two decimals at most.
std::string coordinate(double value);
/// "x y"
std::string point(const Eigen::Vector2d& value);

/// A drawing over a picture of width x height px. Pixel coordinates: the center of the top-left
/// pixel is (0, 0). The label is read out to who cannot see it.
std::string drawing(int width, int height, const std::string& label, const std::string& content);

/// The picture as JPEG in a data URI, at most `widest` pixels wide.
std::string dataUri(const Picture& picture, int widest);

/// "0.0034", "0.034", "0.34", "3.4", "34".
std::string twoDigits(double value);

/// 1, 2 or 5 times a power of ten, not above the value (> 0).
double roundDown(double value);

/// The error that `share` of them do not exceed; 0 if there are none. Takes its own copy to sort.
double quantile(std::vector<double> errors, double share);

}  // namespace afterglow::calib
