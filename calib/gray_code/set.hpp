/// \file
/// Photographs of Gray codes on a chessboard as other programs keep them, and which code they show.
///
/// DIR/capture_*/graycode_NN.png (kamino410/procam-calibration; OpenCV's GrayCodePattern): for
/// each bit of the columns, the highest first, the stripes and their inverse; the same for the
/// rows; then white, black. Codes count from 0, by steps of some pixels.
/// DIR/POSE/cam_NN.png (Brown University's Projector-Camera Calibration and its descendants):
/// white, black, then the same bits, as many of the columns as of the rows: the lowest ones may be
/// missing. Codes lie in the middle of the numbers that their bits can write.
///
/// The projector pixel that lights each pixel of the camera.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/picture.hpp"

namespace afterglow::calib {

enum class GrayCodeLayout { Kamino, Brown };

/// The pictures of one pose of the chessboard, in the order in which they were shown.
struct GrayCodeFiles {
  std::string name;  ///< the folder's
  GrayCodeLayout layout = GrayCodeLayout::Kamino;
  std::vector<std::string> paths;
};

/// Returns the sets in the order of their names. Throws std::runtime_error naming the folder and
/// what is missing in it.
std::vector<GrayCodeFiles> findGrayCode(const std::string& folder);

/// The code of one axis: a projector pixel p has the code (p + offset) / step.
struct GrayAxis {
  int pixels = 0, bits = 0, step = 1, offset = 0;

  /// The middle of a code's stripe; empty if it lies outside the picture.
  std::optional<double> middle(int code) const;
};

struct GrayCode {
  GrayCodeLayout layout = GrayCodeLayout::Kamino;
  GrayAxis across, down;

  std::size_t pictures() const { return std::size_t(2 + 2 * (across.bits + down.bits)); }
  /// Places of the white and the black picture, and of the first of the stripes.
  std::size_t white() const { return layout == GrayCodeLayout::Kamino ? pictures() - 2 : 0; }
  std::size_t stripes() const { return layout == GrayCodeLayout::Kamino ? 0 : 2; }
};

/// The code that so many pictures show with a projector of this size. `step`: Kamino's, px; Brown's
/// follows from their number. Throws std::invalid_argument if it has another number of pictures,
/// naming the steps that would fit: a wrong resolution can look like another step.
GrayCode grayCodeOf(GrayCodeLayout layout, std::size_t pictures, int width, int height,
                    int step = 1);

/// The projector's pixel for each pixel of the photograph, row by row; NaN where it is not lit
/// directly or its stripes cannot be told from their inverse, infinite where its code belongs to no
/// pixel of a picture of the projector's size.
struct DecodedLight {
  int width = 0, height = 0;
  std::vector<Eigen::Vector2f> projector_px;

  const Eigen::Vector2f& at(int x, int y) const {
    return projector_px[std::size_t(y) * std::size_t(width) + std::size_t(x)];
  }
};

/// `pictures`: as `code` has them, of one size. A pixel on the edge between two stripes is taken as
/// exactly between them, which is half a pixel better than either. Pure.
DecodedLight decode(const std::vector<Picture>& pictures, const GrayCode& code);

}  // namespace afterglow::calib
