#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/number_text.hpp"
#include "calib/report/calibration_yaml.hpp"
#include "calib/report/html.hpp"
#include "calib/report/sections.hpp"

namespace afterglow::calib {
namespace {

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

std::string row(const std::string& name, double value, double deviation, const std::string& unit,
                const std::string& meaning) {
  const int decimals = decimalsFor(deviation);
  const std::string space = unit.empty() || unit == "°" ? "" : " ";
  const bool is_held = deviation == 0;
  return element("tr", element("td", element("strong", name)) +
                           element("td", "class=\"n\"",
                                   is_held && value == 0
                                       ? "0"
                                       : withMinus(fixedText(value, decimals)) + space + unit) +
                           element("td", "class=\"n\"",
                                   is_held ? element("span", "class=\"soft\"", "held fixed")
                                           : "± " + fixedText(deviation, decimals) + space + unit) +
                           element("td", "class=\"soft\"", meaning)) +
         "\n";
}

std::string table(const std::string& rows) {
  return element("table", "class=\"parameters\"",
                 element("tr", element("th", "Parameter") + element("th", "class=\"n\"", "Value") +
                                   element("th", "class=\"n\"", "Standard deviation") +
                                   element("th", "Meaning")) +
                     "\n" + rows) +
         "\n";
}

class Parameters {
 public:
  explicit Parameters(const ProjectorEstimate& estimate) : estimate_(estimate) {}

  double deviation(int index) const {
    return std::sqrt(std::max(0.0, estimate_.covariance(index, index)));
  }
  /// Between -1 and 1; 0 if either is held fixed.
  double correlation(int a, int b) const {
    const double product = deviation(a) * deviation(b);
    return product > 0 ? estimate_.covariance(a, b) / product : 0;
  }

  std::string lensRows() const {
    const Eigen::Matrix3d& K = estimate_.projector.K;
    std::string rows = row("fx", K(0, 0), deviation(0), "px", "focal length across") +
                       row("fy", K(1, 1), deviation(1), "px", "focal length down") +
                       row("cx", K(0, 2), deviation(2), "px", "principal point across") +
                       row("cy", K(1, 2), deviation(3), "px", "principal point down");
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
      rows += row(kParameterNames[kLensTerms + i].name, value, sigma, "", kMeanings[i]);
    }
    return rows;
  }

  std::string poseRows() const {
    const Eigen::Isometry3d& T = estimate_.T_camera_projector.matrix();
    const Eigen::AngleAxisd turn(T.linear());
    const Eigen::Vector3d w = turn.angle() * turn.axis();
    std::string rows;
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    static constexpr const char* kPlaces[] = {"to the camera’s right", "down", "forward"};
    for (int i = 0; i < 3; ++i) {
      rows += row(std::string("t") + kAxes[i], 1000 * T.translation()[i],
                  1000 * deviation(kTranslation + i), "mm",
                  std::string("where the projector’s lens is, ") + kPlaces[i]);
    }
    for (int i = 0; i < 3; ++i) {
      rows += row(std::string("w") + kAxes[i], kDegrees * w[i], kDegrees * deviation(kRotation + i),
                  "°", std::string("rotation vector, about ") + kAxes[i]);
    }
    return rows;
  }

 private:
  const ProjectorEstimate& estimate_;
};

/// The words a projector's buyer uses.
std::string lensInWords(const Lens& lens) {
  const double shift = (lens.K(1, 2) - 0.5 * (lens.height - 1)) / lens.height;
  const auto low = unproject(lens, {-0.5, 0.5 * (lens.height - 1)});
  const auto high = unproject(lens, {lens.width - 0.5, 0.5 * (lens.height - 1)});
  std::string text = "Throw ratio " + fixedText(lens.K(0, 0) / lens.width, 2) + " : 1";
  if (low && high) {
    const double angle = std::atan2(low->cross(*high).norm(), low->dot(*high));
    text += ", " + fixedText(angle * kDegrees, 1) + "° wide";
  }
  text += ", lens shift " + fixedText(100 * std::abs(shift), 1) + " % of the picture’s height " +
          (shift > 0 ? "(the optical axis leaves below the picture’s middle)"
                     : "(the optical axis leaves above the picture’s middle)");
  return text + "; a pixel is " + fixedText(1000 / lens.K(0, 0), 2) + " mm at 1 m.";
}

std::string tradeOff(const Parameters& parameters) {
  const double across = parameters.correlation(2, kRotation + 1);
  const double down = parameters.correlation(3, kRotation);
  std::string text =
      "Do not judge the calibration by these deviations. Focal length and distance, principal "
      "point and rotation trade off against each other";
  if (across != 0 || down != 0) {
    text += " (here cx with wy: correlation " + withMinus(fixedText(across, 3)) +
            ", cy with wx: " + withMinus(fixedText(down, 3)) + ")";
  }
  return text +
         ": each alone can be several pixels off while the projected point, where they cancel, is "
         "right to a small part of one. The projected point is what counts; the maps above show "
         "it.";
}

}  // namespace

std::string parameterSection(const Calibration& calibration) {
  const ProjectorEstimate& estimate = calibration.estimate;
  const Parameters parameters(estimate);
  const double apart = 1000 * estimate.T_camera_projector.matrix().translation().norm();
  return element("h2", "The projector’s parameters") +
         element("p", lensInWords(estimate.projector)) + table(parameters.lensRows()) +
         element("p", "T_camera_projector: the projector’s lens is " + fixedText(apart, 1) +
                          " mm from the camera’s. Optical frames: x right, y down, z forward. "
                          "Deviations of the rotation are about the projector’s axes.") +
         table(parameters.poseRows()) + element("p", "class=\"soft\"", tradeOff(parameters)) + "\n";
}

}  // namespace afterglow::calib
