// The photographer of synthetic_rig.hpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <thread>

#include "calib/targets/tag.hpp"
#include "tests/support/synthetic_rig.hpp"

namespace afterglow::test {
namespace {

constexpr double kGamma = 2.2;
constexpr int kSamples = 2;  // rays across a pixel
constexpr double kFloorAlbedo = 0.5, kFloorReach_m = 2, kFloorMiddle_m = 1.5;
constexpr double kNothing = 0.02;  // light from where no surface is
constexpr double kBoardPixel_m = 0.0004;

/// Gray levels, row-major.
struct Raster {
  int width = 0, height = 0;
  std::vector<float> values;

  Raster(int w, int h, float value)
      : width(w), height(h), values(std::size_t(w) * std::size_t(h), value) {}
  float& at(int x, int y) { return values[std::size_t(y) * std::size_t(width) + std::size_t(x)]; }
  float at(int x, int y) const {
    return values[std::size_t(y) * std::size_t(width) + std::size_t(x)];
  }
  /// Bilinear, clamped at the border.
  double sample(double u, double v) const {
    u = std::clamp(u, 0.0, width - 1.0);
    v = std::clamp(v, 0.0, height - 1.0);
    const int x = std::min(static_cast<int>(u), width - 2);
    const int y = std::min(static_cast<int>(v), height - 2);
    const double a = u - x, b = v - y;
    return (1 - b) * ((1 - a) * double(at(x, y)) + a * double(at(x + 1, y))) +
           b * ((1 - a) * double(at(x, y + 1)) + a * double(at(x + 1, y + 1)));
  }
};

/// Runs job(first_row, last_row) on two threads.
void onRows(int rows, const std::function<void(int, int)>& job) {
  std::thread half(job, 0, rows / 2);
  job(rows / 2, rows);
  half.join();
}

/// Blackens a rectangle by how much of each pixel it covers.
void blacken(Raster& raster, double left, double top, double right, double bottom) {
  const auto covered = [](double low, double high, int pixel) {
    return std::max(0.0, std::min(high, pixel + 0.5) - std::max(low, pixel - 0.5));
  };
  const int x0 = std::max(0, static_cast<int>(std::floor(left + 0.5)));
  const int x1 = std::min(raster.width - 1, static_cast<int>(std::floor(right + 0.5)));
  const int y0 = std::max(0, static_cast<int>(std::floor(top + 0.5)));
  const int y1 = std::min(raster.height - 1, static_cast<int>(std::floor(bottom + 0.5)));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      raster.at(x, y) -= float(covered(left, right, x) * covered(top, bottom, y));
    }
  }
}

/// Upright rectangles only. Corners in the raster's pixels.
void drawTag(Raster& raster, const calib::TagCells& cells,
             const std::array<Eigen::Vector2d, 4>& corners) {
  const Eigen::Vector2d cell = (corners[2] - corners[0]) / calib::kTagCells;
  for (int row = 0; row < calib::kTagCells; ++row) {
    for (int column = 0; column < calib::kTagCells; ++column) {
      if (!cells[std::size_t(row)][std::size_t(column)]) continue;
      const double left = corners[0].x() + column * cell.x();
      const double top = corners[0].y() + row * cell.y();
      blacken(raster, left, top, left + cell.x(), top + cell.y());
    }
  }
}

/// Albedo of the sheet: ink is never black, paper never white.
Raster boardAlbedo(const calib::Board& board) {
  const int width = static_cast<int>(std::lround(board.size_m.x() / kBoardPixel_m));
  const int height = static_cast<int>(std::lround(board.size_m.y() / kBoardPixel_m));
  Raster raster(width, height, 1);
  for (const calib::Tag& tag : board.tags) {
    std::array<Eigen::Vector2d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i] = {(tag.corners[i].x() / board.size_m.x() + 0.5) * width - 0.5,
                    (0.5 - tag.corners[i].y() / board.size_m.y()) * height - 0.5};
    }
    drawTag(raster, calib::tagCells(board.family, tag.id), corners);
  }
  for (float& value : raster.values) value = 0.04f + 0.86f * value;
  return raster;
}

/// Directions of the camera's rays on a grid, bilinear between: exact to a thousandth of a pixel.
class RayGrid {
 public:
  explicit RayGrid(const calib::Lens& lens)
      : columns_(lens.width / kStep + 3), rows_(lens.height / kStep + 3) {
    rays_.resize(std::size_t(columns_) * std::size_t(rows_));
    onRows(rows_, [&](int first, int last) {
      for (int row = first; row < last; ++row) {
        for (int column = 0; column < columns_; ++column) {
          const Eigen::Vector2d pixel(kStep * (column - 1), kStep * (row - 1));
          const auto ray = unproject(lens, pixel);
          at(row, column) =
              ray ? Eigen::Vector2d(ray->head<2>()) : Eigen::Vector2d(std::nan(""), std::nan(""));
        }
      }
    });
  }
  Eigen::Vector3d operator()(double u, double v) const {
    const double x = u / kStep + 1, y = v / kStep + 1;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const double a = x - column, b = y - row;
    return ((1 - b) * ((1 - a) * at(row, column) + a * at(row, column + 1)) +
            b * ((1 - a) * at(row + 1, column) + a * at(row + 1, column + 1)))
        .homogeneous();
  }

 private:
  static constexpr int kStep = 4;
  Eigen::Vector2d& at(int row, int column) {
    return rays_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
  }
  const Eigen::Vector2d& at(int row, int column) const {
    return rays_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)];
  }
  int columns_, rows_;
  std::vector<Eigen::Vector2d> rays_;
};

/// What the projector's encoded values mean in light, 0 to 1.
class Decoding {
 public:
  Decoding() {
    for (std::size_t i = 0; i < table_.size(); ++i) {
      table_[i] = std::pow(double(i) / (255 * kFine), kGamma);
    }
  }
  double operator()(double gray) const {
    const double at = gray * kFine;
    const std::size_t i = std::min(static_cast<std::size_t>(at), table_.size() - 2);
    return table_[i] + (at - double(i)) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr std::size_t kFine = 8;
  std::array<double, 255 * kFine + 1> table_;
};

/// The projector's light in the room.
class Beam {
 public:
  Beam(const SyntheticRig& rig, const calib::Picture& shown)
      : lens_(rig.projector),
        T_projector_world_(rig.T_world_projector.matrix().inverse()),
        eye_(rig.T_world_projector.matrix().translation()),
        gain_(rig.projector_gain),
        stretch_(double(shown.width) / lens_.width, double(shown.height) / lens_.height),
        picture_(shown.width, shown.height, 0) {
    std::copy(shown.pixels.begin(), shown.pixels.end(), picture_.values.begin());
  }
  const Eigen::Vector3d& eye() const { return eye_; }

  /// Light on a surface of that normal.
  double at(const Eigen::Vector3d& p_world, const Eigen::Vector3d& normal) const {
    const auto pixel = project(lens_, T_projector_world_ * p_world);
    if (!pixel || !(pixel->minCoeff() > -0.5) || !(pixel->x() < lens_.width - 0.5) ||
        !(pixel->y() < lens_.height - 0.5)) {
      return 0;
    }
    const Eigen::Vector2d at =
        (pixel->array() + 0.5) * stretch_.array() - Eigen::Array2d::Constant(0.5);
    const Eigen::Vector3d way = p_world - eye_;
    const double distance = way.norm();
    return gain_ * decoding_(picture_.sample(at.x(), at.y())) * std::abs(way.dot(normal)) /
           (distance * distance * distance);
  }

 private:
  const calib::Lens& lens_;
  Eigen::Isometry3d T_projector_world_;
  Eigen::Vector3d eye_;
  double gain_;
  Eigen::Vector2d stretch_;
  Raster picture_;
  Decoding decoding_;
};

/// The sheet in the room: where a ray meets it, and what it reflects there.
class Sheet {
 public:
  Sheet(const Raster& albedo, const Eigen::Vector2d& size_m, const BoardPose& pose)
      : albedo_(albedo),
        half_(size_m / 2),
        pixels_per_m_(albedo.width / size_m.x(), albedo.height / size_m.y()),
        T_board_world_(pose.matrix().inverse()),
        normal_(pose.matrix().linear().col(2)) {}

  const Eigen::Vector3d& normal() const { return normal_; }
  /// Way along the ray, infinity where it misses.
  double meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
              Eigen::Vector2d& on_board) const {
    const Eigen::Vector3d o = T_board_world_ * origin, d = T_board_world_.linear() * direction;
    const double way = -o.z() / d.z();
    on_board = (o + way * d).head<2>();
    const bool is_met = way > 1e-6 && (on_board.cwiseAbs() - half_).maxCoeff() <= 0;
    return is_met ? way : std::numeric_limits<double>::infinity();
  }
  double reflected(const Eigen::Vector2d& p) const {
    return albedo_.sample((p.x() + half_.x()) * pixels_per_m_.x() - 0.5,
                          (half_.y() - p.y()) * pixels_per_m_.y() - 0.5);
  }

 private:
  const Raster& albedo_;
  Eigen::Vector2d half_, pixels_per_m_;
  Eigen::Isometry3d T_board_world_;
  Eigen::Vector3d normal_;
};

/// Light toward the camera along one ray.
double radiance(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, const Beam& beam,
                const Sheet* sheet, double ambient) {
  Eigen::Vector2d on_board;
  const double to_board =
      sheet ? sheet->meet(eye, direction, on_board) : std::numeric_limits<double>::infinity();
  const double to_floor = -eye.z() / direction.z();
  const Eigen::Vector3d on_floor = eye + to_floor * direction;
  const bool is_floor = to_floor > 1e-6 && to_floor < to_board &&
                        std::abs(on_floor.x()) <= kFloorReach_m &&
                        std::abs(on_floor.y() - kFloorMiddle_m) <= kFloorReach_m;
  if (is_floor) {
    const Eigen::Vector3d way = on_floor - beam.eye();
    const bool is_shadowed = sheet && sheet->meet(beam.eye(), way, on_board) < 1 - 1e-4;
    const double light = is_shadowed ? 0 : beam.at(on_floor, Eigen::Vector3d::UnitZ());
    return kFloorAlbedo * (ambient + light);
  }
  if (!std::isfinite(to_board)) return kNothing;
  const double light = beam.at(eye + to_board * direction, sheet->normal());
  return sheet->reflected(on_board) * (ambient + light);
}

void blur(Raster& raster, double sigma) {
  if (!(sigma > 0)) return;
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<float> weights;
  for (int i = -reach; i <= reach; ++i)
    weights.push_back(float(std::exp(-0.5 * i * i / sigma / sigma)));
  float sum = 0;
  for (float weight : weights) sum += weight;
  const auto pass = [&](const Raster& from, Raster& to, int dx, int dy) {
    onRows(from.height, [&](int first, int last) {
      for (int y = first; y < last; ++y) {
        for (int x = 0; x < from.width; ++x) {
          float value = 0;
          for (int i = -reach; i <= reach; ++i) {
            value += weights[std::size_t(i + reach)] *
                     from.at(std::clamp(x + i * dx, 0, from.width - 1),
                             std::clamp(y + i * dy, 0, from.height - 1));
          }
          to.at(x, y) = value / sum;
        }
      }
    });
  };
  Raster other = raster;
  pass(raster, other, 1, 0);
  pass(other, raster, 0, 1);
}

/// As a camera with automatic exposure writes it: the brightest half percent above 85 %.
calib::Picture develop(const Raster& light, double noise_gray, std::uint32_t seed) {
  std::vector<float> sorted = light.values;
  const auto bright = sorted.begin() + std::ptrdiff_t(sorted.size() * 995 / 1000);
  std::nth_element(sorted.begin(), bright, sorted.end());
  const double exposure = 0.85 / std::max(double(*bright), 1e-6);
  calib::Picture picture{light.width, light.height, std::vector<std::uint8_t>(light.values.size())};
  onRows(light.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      std::mt19937 random(seed * 100003u + static_cast<std::uint32_t>(y));
      std::normal_distribution<double> noise(0, noise_gray);
      for (int x = 0; x < light.width; ++x) {
        const double exposed = std::min(double(light.at(x, y)) * exposure, 1.0);
        const double gray = 255 * std::pow(exposed, 1 / kGamma) + noise(random);
        picture.pixels[std::size_t(y) * std::size_t(light.width) + std::size_t(x)] =
            static_cast<std::uint8_t>(std::lround(std::clamp(gray, 0.0, 255.0)));
      }
    }
  });
  return picture;
}

}  // namespace

calib::Picture patternPicture(const calib::Pattern& pattern) {
  Raster raster(pattern.width, pattern.height, 1);
  for (const calib::Tag& tag : pattern.tags) {
    drawTag(raster, calib::tagCells(pattern.family, tag.id), tag.corners);
  }
  calib::Picture picture{raster.width, raster.height, {}};
  for (float value : raster.values) {
    picture.pixels.push_back(static_cast<std::uint8_t>(std::lround(255 * double(value))));
  }
  return picture;
}

calib::Picture grayPicture(int width, int height, std::uint8_t gray) {
  return {width, height, std::vector<std::uint8_t>(std::size_t(width) * std::size_t(height), gray)};
}

calib::Picture warped(const calib::Picture& shown, const Eigen::Matrix3d& H_shown_result) {
  Raster raster(shown.width, shown.height, 0);
  std::copy(shown.pixels.begin(), shown.pixels.end(), raster.values.begin());
  calib::Picture result = grayPicture(shown.width, shown.height, 0);
  for (int y = 0; y < shown.height; ++y) {
    for (int x = 0; x < shown.width; ++x) {
      const Eigen::Vector2d at = (H_shown_result * Eigen::Vector3d(x, y, 1)).hnormalized();
      if (!(at.minCoeff() >= -0.5) || at.x() > shown.width - 0.5 || at.y() > shown.height - 0.5) {
        continue;
      }
      result.pixels[std::size_t(y) * std::size_t(shown.width) + std::size_t(x)] =
          static_cast<std::uint8_t>(std::lround(raster.sample(at.x(), at.y())));
    }
  }
  return result;
}

struct Photographer::Impl {
  SyntheticRig rig;
  Raster albedo;
  RayGrid rays;
  calib::Picture pattern, plain;

  explicit Impl(const SyntheticRig& of)
      : rig(of),
        albedo(boardAlbedo(rig.board)),
        rays(rig.camera),
        pattern(test::patternPicture(rig.pattern)),
        plain(grayPicture(rig.projector.width, rig.projector.height)) {}
};

Photographer::Photographer(const SyntheticRig& rig) : impl_(std::make_unique<Impl>(rig)) {}
Photographer::~Photographer() = default;
Photographer::Photographer(Photographer&&) noexcept = default;

calib::Picture Photographer::photograph(const std::optional<BoardPose>& pose,
                                        const calib::Picture& shown, std::uint32_t seed) const {
  const SyntheticRig& rig = impl_->rig;
  const Beam beam(rig, shown);
  std::optional<Sheet> sheet;
  if (pose) sheet.emplace(impl_->albedo, rig.board.size_m, *pose);
  const Eigen::Matrix3d R_world_camera = rig.T_world_camera.matrix().linear();
  const Eigen::Vector3d eye = rig.T_world_camera.matrix().translation();
  Raster light(rig.camera.width, rig.camera.height, 0);
  onRows(light.height, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      for (int x = 0; x < light.width; ++x) {
        double sum = 0;
        for (int i = 0; i < kSamples * kSamples; ++i) {
          const double u = x + (i % kSamples + 0.5) / kSamples - 0.5;
          const double v = y + (i / kSamples + 0.5) / kSamples - 0.5;
          sum += radiance(eye, R_world_camera * impl_->rays(u, v), beam, sheet ? &*sheet : nullptr,
                          rig.ambient);
        }
        light.at(x, y) = float(sum / (kSamples * kSamples));
      }
    }
  });
  blur(light, rig.blur_px);
  return develop(light, rig.noise_gray, seed);
}

calib::Photographs Photographer::photographs(const std::string& name, const BoardPose& pose,
                                             std::uint32_t seed) const {
  return {name, photograph(pose, impl_->pattern, 2 * seed),
          photograph(pose, impl_->plain, 2 * seed + 1)};
}

calib::Picture photograph(const SyntheticRig& rig, const std::optional<BoardPose>& pose,
                          const calib::Picture& shown, std::uint32_t seed) {
  return Photographer(rig).photograph(pose, shown, seed);
}

}  // namespace afterglow::test
