/// \file
/// Numbers as text, independent of the C and C++ locales: a file written where decimals have commas
/// can be read where they have points.
#pragma once

#include <optional>
#include <string>

namespace afterglow::calib {

/// The shortest text that reads back as exactly this number. Always with a point before an
/// exponent: YAML 1.1 readers (PyYAML) take 1e-05 for a string and 1.0e-05 for a number.
std::string exactText(double value);

/// Formats a number with so many decimals; "–" for a number that is not finite. Never "-0.00".
std::string fixedText(double value, int decimals);

/// The whole of the text as one number; empty if it is not one. Reads "nan" and "inf" as no number.
std::optional<double> numberFromText(const std::string& text);

/// Degrees in one radian: radians inside, degrees for people.
constexpr double kDegrees = 180 / 3.14159265358979323846;

}  // namespace afterglow::calib
