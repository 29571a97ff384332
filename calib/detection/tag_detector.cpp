#include "calib/detection/tag_detector.hpp"

#include <apriltag/apriltag.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {
namespace {

/// libapriltag's corners run counterclockwise from the bottom left, with the center of the top-left
/// pixel at (0.5, 0.5).
DetectedTag convert(const apriltag_detection_t& found) {
  DetectedTag tag;
  tag.id = found.id;
  for (std::size_t i = 0; i < 4; ++i) {
    const double* corner = found.p[3 - i];
    tag.corners[i] = Eigen::Vector2d(corner[0] - 0.5, corner[1] - 0.5);
  }
  tag.margin = static_cast<double>(found.decision_margin);
  tag.hamming = found.hamming;
  return tag;
}

/// Returns how much better the code fits the picture as found than turned by half a turn, gray
/// levels summed over the bits.
double uprightness(const apriltag_detection_t& found, const apriltag_family_t& family,
                   const Picture& picture) {
  using Homography = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Eigen::Map<const Homography> H_picture_tag(found.H->data);
  const auto gray = [&](double x, double y) {
    const Eigen::Vector2d at = (H_picture_tag * Eigen::Vector3d(x, y, 1)).hnormalized();
    const bool is_inside =
        at.x() >= 0 && at.x() < picture.width && at.y() >= 0 && at.y() < picture.height;
    if (!is_inside) return 0;
    return static_cast<int>(picture.at(static_cast<int>(at.x()), static_cast<int>(at.y())));
  };
  const auto middle = [](unsigned cell) { return (cell + 0.5) * 2 / kTagCells - 1; };
  double sum = 0;
  for (unsigned bit = 0; bit < family.nbits; ++bit) {
    const bool is_white = (family.codes[found.id] >> (family.nbits - 1 - bit) & 1) != 0;
    const double x = middle(family.bit_x[bit]), y = middle(family.bit_y[bit]);
    sum += (is_white ? 1 : -1) * (gray(x, y) - gray(-x, -y));
  }
  return sum;
}

void requireUsable(const Picture& picture) {
  const std::string size = fmt::format("{} x {}", picture.width, picture.height);
  if (picture.width < 16 || picture.height < 16) {
    throw std::invalid_argument("a picture of " + size + " pixels: expected at least 16 x 16");
  }
  if (picture.pixels.size() != std::size_t(picture.width) * std::size_t(picture.height)) {
    throw std::invalid_argument("a picture of " + size + " pixels with " +
                                std::to_string(picture.pixels.size()) + " gray values");
  }
}

/// Standard deviation of the sensor's noise, gray levels: the median of a mask that ignores flat
/// and evenly sloped places (Immerkaer, Fast Noise Variance Estimation, CVIU 64(2), 1996), so that
/// edges, a minority, do not count.
double noiseOf(const Picture& picture) {
  std::vector<int> histogram(16 * 256, 0);
  int count = 0;
  for (int y = 1; y + 1 < picture.height; y += 2) {
    for (int x = 1; x + 1 < picture.width; x += 2) {
      const auto row = [&](int v) {
        return picture.at(x - 1, v) - 2 * picture.at(x, v) + picture.at(x + 1, v);
      };
      ++histogram[std::size_t(std::abs(row(y - 1) - 2 * row(y) + row(y + 1)))];
      ++count;
    }
  }
  int median = 0;
  for (int below = histogram[0]; 2 * below < count; below += histogram[std::size_t(median)]) {
    ++median;
  }
  return median / 0.6745 / 6;
}

/// Contrast, gray levels, below which a place is flat. Noise alone must stay below it: it costs
/// time, and libapriltag 3.3.0 writes past its tables when a whole large picture is above it.
int leastContrast(const Picture& picture) {
  return std::clamp(static_cast<int>(std::lround(8 * noiseOf(picture))), 5, 255);
}

/// libapriltag 0.10.0 (Debian 11, Ubuntu 20.04) frees what it never allocated in pictures of fewer
/// than 50,000 pixels, after decimation. This many rows are enough.
int leastRows(const Picture& picture, double decimation) {
  constexpr double kLeastPixels = 60000;
  return static_cast<int>(std::ceil(kLeastPixels * decimation * decimation / picture.width));
}

/// Continued below by its last row.
Picture withRows(const Picture& picture, int rows) {
  Picture larger = picture;
  larger.height = rows;
  const std::vector<std::uint8_t> last(picture.pixels.end() - picture.width, picture.pixels.end());
  for (int y = picture.height; y < rows; ++y) {
    larger.pixels.insert(larger.pixels.end(), last.begin(), last.end());
  }
  return larger;
}

}  // namespace

struct TagDetector::Impl {
  FamilyHandle family;
  std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector;

  explicit Impl(const std::string& name)
      : family(makeFamily(name)), detector(apriltag_detector_create(), apriltag_detector_destroy) {
    apriltag_detector_add_family(detector.get(), family.get());
  }
};

TagDetector::TagDetector(const std::string& family, double decimation, TagEdges edges)
    : impl_(std::make_unique<Impl>(family)) {
  impl_->detector->quad_decimate = static_cast<float>(decimation);
  impl_->detector->nthreads = 1;
  impl_->detector->refine_edges = edges == TagEdges::Refined;
}
TagDetector::~TagDetector() = default;
TagDetector::TagDetector(TagDetector&&) noexcept = default;

std::vector<DetectedTag> TagDetector::detect(const Picture& picture) const {
  requireUsable(picture);
  const int rows = leastRows(picture, static_cast<double>(impl_->detector->quad_decimate));
  const bool is_small = picture.height < rows;
  const Picture enlarged = is_small ? withRows(picture, rows) : Picture();
  const Picture& seen = is_small ? enlarged : picture;
  // The library reads from it only.
  image_u8_t image{seen.width, seen.height, seen.width,
                   const_cast<std::uint8_t*>(seen.pixels.data())};
  impl_->detector->qtp.min_white_black_diff = leastContrast(picture);
  const std::unique_ptr<zarray_t, void (*)(zarray_t*)> found(
      apriltag_detector_detect(impl_->detector.get(), &image), apriltag_detections_destroy);
  std::vector<DetectedTag> tags;
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, &detection);
    tags.push_back(convert(*detection));
    // libapriltag 0.10.0 (Debian 11, Ubuntu 20.04) gives tags near a quarter turn a half too much.
    if (uprightness(*detection, *impl_->family, picture) < 0) {
      std::rotate(tags.back().corners.begin(), tags.back().corners.begin() + 2,
                  tags.back().corners.end());
    }
  }
  std::sort(tags.begin(), tags.end(),
            [](const DetectedTag& a, const DetectedTag& b) { return a.id < b.id; });
  return tags;
}

Picture mirrored(const Picture& picture) {
  Picture result = picture;
  for (int y = 0; y < picture.height; ++y) {
    const auto row = result.pixels.begin() + std::ptrdiff_t(y) * picture.width;
    std::reverse(row, row + picture.width);
  }
  return result;
}

}  // namespace afterglow::calib
