#include "calib/report/parameters.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/number_text.hpp"
#include "calib/report/calibration_yaml.hpp"

namespace afterglow::calib {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kLensTerms = 4, kRotation = 12, kTranslation = 15;

/// So many decimals that the deviation has two digits.
int decimalsFor(double deviation) {
  if (!(deviation > 0)) return 3;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(deviation))), 0, 9);
}

/// A hyphen is too short to be seen before a number.
std::string withMinus(const std::string& number) {
  return number.rfind('-', 0) == 0 ? "−" + number.substr(1) : number;
}

Json row(const std::string& name, double value, double deviation, const std::string& unit,
         const std::string& meaning) {
  const int decimals = decimalsFor(deviation);
  const std::string after = unit.empty() || unit == "°" ? unit : " " + unit;
  const bool is_held = deviation == 0;
  return {{"name", name},
          {"value", is_held && value == 0 ? "0" : withMinus(fixedText(value, decimals)) + after},
          {"deviation", is_held ? Json() : Json("± " + fixedText(deviation, decimals) + after)},
          {"meaning", meaning}};
}

class Parameters {
 public:
  explicit Parameters(const ProjectorEstimate& estimate) : estimate_(estimate) {}

  double deviation(int index) const {
    return std::sqrt(std::max(0.0, estimate_.covariance(index, index)));
  }
  /// Returns the correlation, between -1 and 1; 0 if either is held fixed.
  double correlation(int a, int b) const {
    const double product = deviation(a) * deviation(b);
    return product > 0 ? estimate_.covariance(a, b) / product : 0;
  }

  Json lensRows() const {
    const Eigen::Matrix3d& K = estimate_.projector.K;
    Json rows = Json::array({row("fx", K(0, 0), deviation(0), "px", "focal length across"),
                             row("fy", K(1, 1), deviation(1), "px", "focal length down"),
                             row("cx", K(0, 2), deviation(2), "px", "principal point across"),
                             row("cy", K(1, 2), deviation(3), "px", "principal point down")});
    static constexpr const char* kMeanings[] = {"radial, r²",
                                                "radial, r⁴",
                                                "tangential",
                                                "tangential",
                                                "radial, r⁶",
                                                "radial, r² of the divisor",
                                                "radial, r⁴ of the divisor",
                                                "radial, r⁶ of the divisor"};
    for (int i = 0; i < 8; ++i) {
      const double value = estimate_.projector.D[static_cast<std::size_t>(i)];
      const double sigma = deviation(kLensTerms + i);
      if (i > 4 && value == 0 && sigma == 0) continue;  // plumb_bob has no divisor
      rows.push_back(row(kParameterNames[kLensTerms + i].name, value, sigma, "", kMeanings[i]));
    }
    return rows;
  }

  Json poseRows() const {
    const Eigen::Isometry3d& T = estimate_.T_camera_projector.matrix();
    const Eigen::AngleAxisd turn(T.linear());
    const Eigen::Vector3d w = turn.angle() * turn.axis();
    Json rows = Json::array();
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    static constexpr const char* kPlaces[] = {"to the camera’s right", "down", "forward"};
    for (int i = 0; i < 3; ++i) {
      rows.push_back(row(std::string("t") + kAxes[i], 1000 * T.translation()[i],
                         1000 * deviation(kTranslation + i), "mm",
                         std::string("where the projector’s lens is, ") + kPlaces[i]));
    }
    for (int i = 0; i < 3; ++i) {
      rows.push_back(row(std::string("w") + kAxes[i], kDegrees * w[i],
                         kDegrees * deviation(kRotation + i), "°",
                         std::string("rotation vector, about ") + kAxes[i]));
    }
    return rows;
  }

 private:
  const ProjectorEstimate& estimate_;
};

/// Returns the facts that a projector's buyer asks for.
Json lensFacts(const Lens& lens) {
  const double shift = (lens.K(1, 2) - 0.5 * (lens.height - 1)) / lens.height;
  const auto low = unproject(lens, {-0.5, 0.5 * (lens.height - 1)});
  const auto high = unproject(lens, {lens.width - 0.5, 0.5 * (lens.height - 1)});
  Json data = {{"throw_ratio", lens.K(0, 0) / lens.width},
               {"wide_deg", nullptr},
               {"shift", std::abs(shift)},
               {"shift_side", shift > 0 ? "below" : "above"},
               {"pixel_mm", 1000 / lens.K(0, 0)}};
  if (low && high) {
    data["wide_deg"] = kDegrees * std::atan2(low->cross(*high).norm(), low->dot(*high));
  }
  return data;
}

/// Returns how principal point and rotation trade off against each other; null if either is held
/// fixed.
Json tradeOff(const Parameters& parameters) {
  const double across = parameters.correlation(2, kRotation + 1);
  const double down = parameters.correlation(3, kRotation);
  if (across == 0 && down == 0) return nullptr;
  return {{"across", withMinus(fixedText(across, 3))}, {"down", withMinus(fixedText(down, 3))}};
}

}  // namespace

void addParameters(const ProjectorEstimate& estimate, Json& data) {
  const Parameters parameters(estimate);
  data["lens"] = lensFacts(estimate.projector);
  data["lens"]["parameters"] = parameters.lensRows();
  data["pose"] = {{"apart_mm", 1000 * estimate.T_camera_projector.matrix().translation().norm()},
                  {"parameters", parameters.poseRows()},
                  {"trade_off", tradeOff(parameters)}};
}

}  // namespace afterglow::calib
