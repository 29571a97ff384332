/// \file
/// A referee for surfaces that are not even: a physically based renderer of a projector on wood,
/// tiles or a carpet, seen by a camera, and CIEDE2000. It shares no code with the project.
///
/// Light is spectral, 31 bands from 400 to 700 nm; surfaces are Lambertian, their reflectance mixed
/// of a few spectra by procedural patterns. A projector sends as much light through each pixel; it
/// spreads with the inverse square of the distance and the cosine of its angle. The room's light is
/// even. The camera sees CIE 1931 colors (Wyman, Sloan, Shirley 2013) as linear sRGB and has a
/// lens, vignetting, noise, a response curve and 8 bits.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace afterglow::test {

// ---------------------------------------------------------------------------------------- colors
/// IEC 61966-2-1.
inline double refereeDecode(double v) {
  return v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92;
}
inline double refereeEncode(double l) {
  l = std::clamp(l, 0.0, 1.0);
  return l > 0.0031308 ? 1.055 * std::pow(l, 1 / 2.4) - 0.055 : 12.92 * l;
}

/// CIELAB under D65 of linear sRGB.
inline std::array<double, 3> refereeLab(const Eigen::Vector3d& rgb) {
  const double X = 0.4124564 * rgb[0] + 0.3575761 * rgb[1] + 0.1804375 * rgb[2];
  const double Y = 0.2126729 * rgb[0] + 0.7151522 * rgb[1] + 0.0721750 * rgb[2];
  const double Z = 0.0193339 * rgb[0] + 0.1191920 * rgb[1] + 0.9503041 * rgb[2];
  const auto f = [](double t) {
    return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  };
  const double fx = f(X / 0.95047), fy = f(Y), fz = f(Z / 1.08883);
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

/// CIEDE2000 as in the appendix of Sharma, Wu and Dalal 2005, angles in radians.
inline double refereeDifference(const std::array<double, 3>& one,
                                const std::array<double, 3>& two) {
  const double pi = std::acos(-1.0), pow25_7 = 6103515625.0;
  const double mean_C = 0.5 * (std::hypot(one[1], one[2]) + std::hypot(two[1], two[2])),
               C7 = std::pow(mean_C, 7);
  const double G = 0.5 * (1 - std::sqrt(C7 / (C7 + pow25_7)));
  struct Polar {
    double C, h;
  };
  const auto polar = [&](const std::array<double, 3>& lab) {
    const double a = (1 + G) * lab[1], C = std::hypot(a, lab[2]);
    double h = C == 0 ? 0 : std::atan2(lab[2], a);
    if (h < 0) h += 2 * pi;
    return Polar{C, h};
  };
  const Polar p = polar(one), q = polar(two);
  double dh = p.C * q.C == 0 ? 0 : q.h - p.h;
  if (dh > pi) dh -= 2 * pi;
  if (dh < -pi) dh += 2 * pi;
  double mean_h = p.h + q.h;
  if (p.C * q.C != 0) {
    if (std::abs(p.h - q.h) > pi) mean_h += mean_h < 2 * pi ? 2 * pi : -2 * pi;
    mean_h /= 2;
  }
  const double dL = two[0] - one[0], dC = q.C - p.C;
  const double dH = 2 * std::sqrt(p.C * q.C) * std::sin(dh / 2);
  const double mean_L = (one[0] + two[0]) / 2, C = (p.C + q.C) / 2,
               L2 = (mean_L - 50) * (mean_L - 50);
  const double deg = pi / 180;
  const double T = 1 - 0.17 * std::cos(mean_h - 30 * deg) + 0.24 * std::cos(2 * mean_h) +
                   0.32 * std::cos(3 * mean_h + 6 * deg) - 0.2 * std::cos(4 * mean_h - 63 * deg);
  const double bump = (mean_h / deg - 275) / 25,
               R_C = 2 * std::sqrt(std::pow(C, 7) / (std::pow(C, 7) + pow25_7));
  const double R_T = -std::sin(60 * deg * std::exp(-bump * bump)) * R_C;
  const double l = dL / (1 + 0.015 * L2 / std::sqrt(20 + L2)), c = dC / (1 + 0.045 * C),
               H = dH / (1 + 0.015 * C * T);
  return std::sqrt(l * l + c * c + H * H + R_T * c * H);
}

// --------------------------------------------------------------------------------------- spectra
constexpr int kBands = 31;
using Spectrum = std::array<double, kBands>;
inline double wavelength(int band) { return 400 + 10 * band; }

template <typename Of>
Spectrum spectrum(const Of& of) {
  Spectrum values{};
  for (int band = 0; band < kBands; ++band) values[std::size_t(band)] = of(wavelength(band));
  return values;
}
inline double lobe(double x, double center, double below, double above) {
  const double t = (x - center) / (x < center ? below : above);
  return std::exp(-0.5 * t * t);
}

/// Linear sRGB of light of this spectrum.
inline Eigen::Vector3d seenColor(const Spectrum& light) {
  Eigen::Vector3d xyz(0, 0, 0);
  for (int band = 0; band < kBands; ++band) {
    const double w = wavelength(band), e = light[std::size_t(band)];
    xyz += e *
           Eigen::Vector3d(1.056 * lobe(w, 599.8, 37.9, 31.0) + 0.362 * lobe(w, 442.0, 16.0, 26.7) -
                               0.065 * lobe(w, 501.1, 20.4, 26.2),
                           0.821 * lobe(w, 568.8, 46.9, 40.5) + 0.286 * lobe(w, 530.9, 16.3, 31.1),
                           1.217 * lobe(w, 437.0, 11.8, 36.0) + 0.681 * lobe(w, 459.0, 26.0, 13.8));
  }
  Eigen::Matrix3d to_rgb;
  to_rgb << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434,
      -0.2040259, 1.0572252;
  return to_rgb * xyz;
}

// ---------------------------------------------------------------------------------------- optics
/// A pinhole with two terms of radial distortion, somewhere over the surface (z = 0 is its plane).
struct RoomOptics {
  int width, height;
  double f, cx, cy, k1, k2;
  Eigen::Isometry3d T_optical_surface;

  Eigen::Vector2d bend(const Eigen::Vector2d& ray) const {
    const double s = ray.squaredNorm();
    return ray * (1 + k1 * s + k2 * s * s);
  }
  std::optional<Eigen::Vector2d> pixelOf(const Eigen::Vector3d& p_surface) const {
    const Eigen::Vector3d p = T_optical_surface * p_surface;
    if (p.z() <= 0) return std::nullopt;
    const Eigen::Vector2d d = bend(p.head<2>() / p.z());
    return Eigen::Vector2d(f * d.x() + cx, f * d.y() + cy);
  }
  bool holds(const Eigen::Vector2d& pixel, double rim) const {
    return pixel.x() >= rim && pixel.y() >= rim && pixel.x() <= width - 1 - rim &&
           pixel.y() <= height - 1 - rim;
  }
  /// The place that a pixel shows.
  std::optional<Eigen::Vector2d> placeOf(double u, double v) const {
    const Eigen::Vector2d d((u - cx) / f, (v - cy) / f);
    Eigen::Vector2d ray = d;
    for (int i = 0; i < 20; ++i)
      ray = d / (1 + k1 * ray.squaredNorm() + k2 * ray.squaredNorm() * ray.squaredNorm());
    const Eigen::Isometry3d T = T_optical_surface.inverse();
    const Eigen::Vector3d eye = T.translation(),
                          way = T.linear() * Eigen::Vector3d(ray.x(), ray.y(), 1);
    if (way.z() * eye.z() >= 0) return std::nullopt;
    return Eigen::Vector2d((eye - eye.z() / way.z() * way).head<2>());
  }
  /// Light at a place, where every pixel sends the same flux: each into its own solid angle.
  double irradiance(const Eigen::Vector3d& p_surface) const {
    const Eigen::Vector3d p = T_optical_surface * p_surface;
    const Eigen::Vector2d ray = p.head<2>() / p.z();
    const double e = 1e-5;
    const Eigen::Vector2d dx = (bend(ray + Eigen::Vector2d(e, 0)) -
                                bend(ray - Eigen::Vector2d(e, 0))) /
                               (2 * e),
                          dy = (bend(ray + Eigen::Vector2d(0, e)) -
                                bend(ray - Eigen::Vector2d(0, e))) /
                               (2 * e);
    const double pixels = f * f * std::abs(dx.x() * dy.y() - dx.y() * dy.x());
    const double solid_angle = std::pow(1 + ray.squaredNorm(), -1.5) / pixels;
    const double cosine = std::abs(T_optical_surface.linear().col(2).dot(p.normalized()));
    return 1 / solid_angle * cosine / p.squaredNorm();
  }
};

// -------------------------------------------------------------------------------------- patterns
/// Smooth noise, 0 to 1, of about this many meters.
inline double valueNoise(double x, double y, double size, unsigned seed) {
  const double u = x / size + 1000, v = y / size + 1000;
  const auto hashed = [seed](long i, long j) {
    std::uint32_t h = seed * 374761393u + static_cast<std::uint32_t>(i) * 668265263u +
                      static_cast<std::uint32_t>(j) * 2246822519u;
    h = (h ^ (h >> 13)) * 1274126177u;
    h ^= h >> 16;
    return static_cast<double>(h & 0xffffff) / 0xffffff;
  };
  const long i = std::lround(std::floor(u)), j = std::lround(std::floor(v));
  const auto ease = [](double t) { return t * t * (3 - 2 * t); };
  const double a = ease(u - static_cast<double>(i)), b = ease(v - static_cast<double>(j));
  return (1 - b) * ((1 - a) * hashed(i, j) + a * hashed(i + 1, j)) +
         b * ((1 - a) * hashed(i, j + 1) + a * hashed(i + 1, j + 1));
}

enum class RoomSurface { Wood, Tiles, Carpet };

/// Shares of up to four reflectances at a place.
inline std::array<double, 4> sharesAt(RoomSurface kind, double x, double y) {
  if (kind == RoomSurface::Wood) {
    // Planks of 12 cm, each with its own tone, years that run along x, and fibers.
    const double plank = std::floor(y / 0.12);
    const double tone = valueNoise(plank * 7.3, 0.5, 1, 3);
    const double bend = 0.03 * valueNoise(x + 3 * plank, y, 0.25, 5);
    const double years = 0.5 + 0.5 * std::sin((y + bend) / 0.012 * 2 * M_PI / 2 + 5 * tone);
    const double fiber = valueNoise(x / 12, y, 0.004, 9);
    const double gap = std::abs(y - 0.12 * std::round(y / 0.12)) < 0.001 ? 0.6 : 0;
    const double dark =
        std::clamp(0.15 + 0.35 * years * years + 0.25 * tone + 0.2 * (fiber - 0.5) + gap, 0.0, 1.0);
    return {1 - dark, dark, 0, 0};
  }
  if (kind == RoomSurface::Tiles) {
    // 15 cm, three glazes, joints of 5 mm.
    const double i = std::floor(x / 0.15), j = std::floor(y / 0.15);
    const double fx = x - 0.15 * i, fy = y - 0.15 * j, edge = 0.0025;
    if (std::min({fx, fy, 0.15 - fx, 0.15 - fy}) < edge) return {0, 0, 0, 1};
    const double pick = valueNoise(i * 3.7, j * 3.7, 1, 17),
                 cloud = 0.25 * valueNoise(x, y, 0.05, 21);
    const int glaze = pick < 0.42 ? 0 : pick < 0.58 ? 1 : 2;
    std::array<double, 4> shares{};
    shares[std::size_t(glaze)] = 1 - cloud;
    shares[3] = cloud;
    return shares;
  }
  // A pattern of two wools on a third, and tufts that shade each other.
  const double u = std::fmod(std::abs(x) + 0.5 * std::abs(y), 0.2) / 0.2,
               v = std::fmod(std::abs(y), 0.16) / 0.16;
  const double figure =
      std::sin(2 * M_PI * u) * std::sin(2 * M_PI * v) + 0.3 * (valueNoise(x, y, 0.03, 31) - 0.5);
  const double a = std::clamp((figure - 0.15) * 4, 0.0, 1.0),
               b = std::clamp((-figure - 0.25) * 4, 0.0, 1.0);
  const double tuft =
      0.7 + 0.45 * (valueNoise(x, y, 0.006, 37) - 0.5) + 0.2 * valueNoise(x, y, 0.08, 41);
  return {tuft * a, tuft * b, tuft * (1 - a - b), 0};
}

inline std::array<Spectrum, 4> reflectancesOf(RoomSurface kind) {
  const auto rising = [](double from, double to, double middle, double width) {
    return spectrum(
        [=](double w) { return from + (to - from) / (1 + std::exp(-(w - middle) / width)); });
  };
  const auto gray = [](double level) { return spectrum([=](double) { return level; }); };
  if (kind == RoomSurface::Wood)
    return {rising(0.22, 0.72, 540, 45), rising(0.08, 0.42, 570, 45), gray(0), gray(0)};
  if (kind == RoomSurface::Tiles) {
    return {rising(0.55, 0.75, 530, 40),
            spectrum([](double w) { return 0.28 + 0.22 * lobe(w, 500, 60, 60); }),
            rising(0.22, 0.6, 580, 25), gray(0.28)};
  }
  return {rising(0.15, 0.55, 585, 20),
          spectrum([](double w) { return 0.14 + 0.2 * lobe(w, 470, 45, 60); }),
          rising(0.35, 0.62, 520, 45), gray(0)};
}

// ------------------------------------------------------------------------------------------ room
class TexturedRoom {
 public:
  using Light = std::array<double, 3>;

  explicit TexturedRoom(RoomSurface surface, unsigned seed = 1) : kind_(surface), random_(seed) {
    std::array<Spectrum, 3> primaries = {
        spectrum([](double w) { return 0.01 + lobe(w, 612, 22, 35); }),
        spectrum([](double w) { return 0.02 + 0.75 * lobe(w, 545, 32, 34); }),
        spectrum([](double w) { return 0.01 + 1.1 * lobe(w, 455, 18, 22); })};
    const Spectrum lamp = spectrum([](double w) { return 0.6 + 0.4 * (w - 400) / 300; });
    const auto through = [](const Spectrum& light, const Spectrum& reflectance) {
      Spectrum product{};
      for (std::size_t i = 0; i < kBands; ++i) product[i] = light[i] * reflectance[i];
      return product;
    };
    double white = 0;
    for (const Spectrum& primary : primaries) white += seenColor(primary).y();
    const double room = seenColor(lamp).y();
    const auto reflectances = reflectancesOf(surface);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t p = 0; p < 3; ++p) {
        M_seen_light_[i].col(int(p)) = seenColor(through(primaries[p], reflectances[i])) / white;
      }
      dark_[i] = room_light / room * seenColor(through(lamp, reflectances[i]));
    }
  }

  RoomOptics projector{}, camera{};
  double unit = 1;           ///< irradiance that is full light
  double exposure = 0.8;     ///< camera's value of full light, unless open() sets it
  double vignetting = 0.35;  ///< in the camera's corners
  double noise = 0.004;      ///< of full scale, at full light
  /// The camera's response, light to value.
  std::function<double(double)> response = refereeEncode;

  /// The projector's: an S on a power of 2.2; its black is a thousandth.
  static double lightOfValue(double value) {
    const double t = std::pow(value / 255, 2.2);
    return 0.001 + 0.999 * (0.85 * t + 0.15 * t * t * (3 - 2 * t));
  }

  struct Look {
    Eigen::Vector3d dark = Eigen::Vector3d::Zero();
    Eigen::Matrix3d M_seen_light = Eigen::Matrix3d::Zero();  ///< the light's fall-off included
  };
  Look lookAt(double x, double y) const {
    const auto shares = sharesAt(kind_, x, y);
    Look look;
    for (std::size_t i = 0; i < 4; ++i) {
      if (shares[i] == 0) continue;
      look.dark += shares[i] * dark_[i];
      look.M_seen_light += shares[i] * M_seen_light_[i];
    }
    look.M_seen_light *= projector.irradiance({x, y, 0}) / unit;
    return look;
  }

  /// The mean over a square, as eyes see it.
  Look lookAround(const Eigen::Vector2d& place, double side) const {
    constexpr int kSamples = 3;
    Look mean;
    for (int i = 0; i < kSamples * kSamples; ++i) {
      const Look look = lookAt(place.x() + side * ((i % kSamples + 0.5) / kSamples - 0.5),
                               place.y() + side * ((i / kSamples + 0.5) / kSamples - 0.5));
      mean.dark += look.dark / (kSamples * kSamples);
      mean.M_seen_light += look.M_seen_light / (kSamples * kSamples);
    }
    return mean;
  }

  /// Linear sRGB at a place while the projector shows an image (RGB, row by row). Pixels are soft:
  /// bilinear.
  Eigen::Vector3d seen(const Eigen::Vector2d& place, const std::vector<std::uint8_t>& rgb) const {
    const Look look = lookAt(place.x(), place.y());
    const auto pixel = projector.pixelOf({place.x(), place.y(), 0});
    if (!pixel || !projector.holds(*pixel, 0)) return look.dark;
    return look.dark + look.M_seen_light * lightThrough(*pixel, rgb);
  }
  Eigen::Vector3d seenAround(const Eigen::Vector2d& place, double side,
                             const std::vector<std::uint8_t>& rgb) const {
    Eigen::Vector3d mean(0, 0, 0);
    for (int i = 0; i < 9; ++i) {
      mean += seen(place + side * Eigen::Vector2d((i % 3 + 0.5) / 3 - 0.5, (i / 3 + 0.5) / 3 - 0.5),
                   rgb) /
              9;
    }
    return mean;
  }

  /// What the camera sees of the room; then photographs of even colors are quickly made.
  void open() {
    looks_.assign(std::size_t(camera.width) * std::size_t(camera.height), {});
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        Look& mean = looks_[std::size_t(y) * std::size_t(camera.width) + std::size_t(x)];
        for (int i = 0; i < 4; ++i) {
          const auto place = camera.placeOf(x - 0.25 + 0.5 * (i % 2), y - 0.25 + 0.5 * (i / 2));
          if (!place) continue;
          Look look = lookAt(place->x(), place->y());
          const auto pixel = projector.pixelOf({place->x(), place->y(), 0});
          if (!pixel || !projector.holds(*pixel, -0.5)) look.M_seen_light.setZero();
          mean.dark += look.dark / 4;
          mean.M_seen_light += look.M_seen_light / 4;
        }
      }
    }
    // As a photographer does: white just not overexposed.
    double brightest = 0;
    for (const Look& look : looks_) {
      brightest = std::max(brightest, (look.dark + look.M_seen_light.rowwise().sum()).maxCoeff());
    }
    exposure = 0.85 / brightest;
    for (std::size_t i = 0; i < codes_.size(); ++i) {
      const double value =
          response(static_cast<double>(i) / static_cast<double>(codes_.size() - 1));
      codes_[i] = std::uint8_t(std::lround(255 * std::clamp(value, 0.0, 1.0)));
    }
    for (double& some : noise_) some = normal_(random_);
  }

  /// Blue first, as OpenCV has it.
  cv::Mat photograph(const std::array<std::uint8_t, 3>& shown) {
    const Eigen::Vector3d light(lightOfValue(shown[0]), lightOfValue(shown[1]),
                                lightOfValue(shown[2]));
    return expose([&](std::size_t i) { return looks_[i].dark + looks_[i].M_seen_light * light; });
  }
  /// Of a plain, evenly lit sheet.
  cv::Mat photographFlat() {
    return expose([](std::size_t) { return Eigen::Vector3d(0.9, 0.9, 0.9); });
  }
  /// The room as the camera would see it without vignetting and noise, an image being shown.
  cv::Mat picture(const std::vector<std::uint8_t>& rgb, double white) const {
    cv::Mat out(camera.height, camera.width, CV_8UC3);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const auto place = camera.placeOf(x, y);
        const Eigen::Vector3d light =
            place ? Eigen::Vector3d(seen(*place, rgb)) : Eigen::Vector3d(0, 0, 0);
        for (int i = 0; i < 3; ++i) {
          out.at<cv::Vec3b>(y, x)[2 - i] =
              std::uint8_t(std::lround(255 * refereeEncode(light[i] / white)));
        }
      }
    }
    return out;
  }

  static constexpr double room_light = 0.02;  ///< room_light of the projector's white

 private:
  Eigen::Vector3d lightThrough(const Eigen::Vector2d& pixel,
                               const std::vector<std::uint8_t>& rgb) const {
    const int x = std::min(int(pixel.x()), projector.width - 2),
              y = std::min(int(pixel.y()), projector.height - 2);
    const double a = pixel.x() - x, b = pixel.y() - y;
    Eigen::Vector3d light(0, 0, 0);
    for (int i = 0; i < 4; ++i) {
      const double share = (i % 2 ? a : 1 - a) * (i / 2 ? b : 1 - b);
      const std::uint8_t* const v =
          &rgb[3 *
               (std::size_t(y + i / 2) * std::size_t(projector.width) + std::size_t(x + i % 2))];
      light += share * Eigen::Vector3d(values_[v[0]], values_[v[1]], values_[v[2]]);
    }
    return light;
  }

  template <typename Of>
  cv::Mat expose(const Of& of) {
    cv::Mat out(camera.height, camera.width, CV_8UC3);
    const double corner = std::hypot(camera.width, camera.height) / 2;
    std::size_t next = random_();
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double r =
            std::hypot(x - (camera.width - 1) / 2.0, y - (camera.height - 1) / 2.0) / corner;
        const double shade = exposure * (1 - vignetting * r * r);
        const Eigen::Vector3d light =
            of(std::size_t(y) * std::size_t(camera.width) + std::size_t(x));
        for (int i = 0; i < 3; ++i) {
          const double exact = std::max(0.0, shade * light[i]);
          const double value =
              exact + noise * std::sqrt(0.02 + exact) * noise_[next++ % noise_.size()];
          out.at<cv::Vec3b>(y, x)[2 - i] = codes_[std::size_t(
              std::lround(std::clamp(value, 0.0, 1.0) * double(codes_.size() - 1)))];
        }
      }
    }
    return out;
  }

  static std::array<double, 256> values() {
    std::array<double, 256> all{};
    for (int i = 0; i < 256; ++i) all[std::size_t(i)] = lightOfValue(i);
    return all;
  }

  RoomSurface kind_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::array<Eigen::Matrix3d, 4> M_seen_light_;
  std::array<Eigen::Vector3d, 4> dark_;
  std::array<double, 256> values_ = values();
  std::vector<Look> looks_;
  std::vector<std::uint8_t> codes_ = std::vector<std::uint8_t>(1 << 16);
  std::vector<double> noise_ = std::vector<double>(99991);
};

}  // namespace afterglow::test
