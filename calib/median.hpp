/// \file
/// The median, robust to less than half of the values.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace afterglow::calib {

/// Returns the median; for an even number of values, the upper of the two in the middle. NaN (not
/// measurable) counts as infinite. Returns `none` if there are no values.
inline double median(std::vector<double> values, double none) {
  if (values.empty()) return none;
  for (double& value : values) {
    if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace afterglow::calib
