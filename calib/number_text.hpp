/// \file
/// Numbers as text, independent of the C and C++ locales: a file written where decimals have commas
/// can be read where they have points; and values as they stand in the YAML files that Afterglow
/// writes.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

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

/// Returns the text in double quotes, which take any text, and on which every YAML reader agrees.
std::string yamlText(const std::string& text);

/// Returns the numbers in brackets, row by row: "[1, 0, 0, 1]".
template <typename Matrix>
std::string yamlNumbers(const Eigen::MatrixBase<Matrix>& matrix) {
  std::string text;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      text += (text.empty() ? "[" : ", ") + exactText(matrix(row, column));
    }
  }
  return text.empty() ? "[]" : text + "]";
}

/// Returns the rows in brackets of their own: {"[1, 0]", "[0, 1]"}.
template <typename Matrix>
std::vector<std::string> yamlRows(const Eigen::MatrixBase<Matrix>& matrix) {
  std::vector<std::string> rows;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    rows.push_back(yamlNumbers(matrix.row(row)));
  }
  return rows;
}

}  // namespace afterglow::calib
