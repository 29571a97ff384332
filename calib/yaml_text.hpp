/// \file
/// Values as they stand in the YAML files that Afterglow writes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/number_text.hpp"

namespace afterglow::calib {

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
