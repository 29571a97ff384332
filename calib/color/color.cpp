#include "calib/color/color.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>

#include "calib/number_text.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
namespace {

/// Lightness and the like: a cube root, and a line where it would be too steep.
double labCurve(double share) {
  constexpr double kEdge = 6.0 / 29;
  return share > kEdge * kEdge * kEdge ? std::cbrt(share) : share / (3 * kEdge * kEdge) + 4.0 / 29;
}

double degrees(double radians) { return radians * 180 / M_PI; }
double radians(double degrees) { return degrees * M_PI / 180; }

/// 0 to 360; 0 for gray.
double hue(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double angle = degrees(std::atan2(b, a));
  return angle < 0 ? angle + 360 : angle;
}

double seventh(double chroma) {
  const double power = std::pow(chroma, 7);
  return std::sqrt(power / (power + std::pow(25.0, 7)));
}

/// Returns the way from one hue to the other, the short way; 0 if either is gray.
double hueStep(double from, double to, bool is_gray) {
  if (is_gray) return 0;
  const double step = to - from;
  return step > 180 ? step - 360 : step < -180 ? step + 360 : step;
}

double meanHue(double a, double b, bool is_gray) {
  if (is_gray) return a + b;
  if (std::abs(a - b) <= 180) return (a + b) / 2;
  return a + b < 360 ? (a + b + 360) / 2 : (a + b - 360) / 2;
}

constexpr double kOverexposed = 0.95, kUnderexposed = 0.02;
constexpr double kAdapted = 0.03;         // of full light, between two photographs of one color
constexpr double kNotAdding = 0.1;        // of the sum of the primaries
constexpr double kLeastDeterminant = 1e-3;
constexpr std::size_t kFewestLevels = 3;
const char* const kChannels[] = {"red", "green", "blue"};
const std::vector<std::pair<std::string, Rgb>> kNamed = {
    {"white", {255, 255, 255}}, {"red", {255, 0, 0}},      {"green", {0, 255, 0}},
    {"blue", {0, 0, 255}},      {"yellow", {255, 255, 0}}, {"cyan", {0, 255, 255}},
    {"magenta", {255, 0, 255}}, {"orange", {255, 128, 0}}, {"gray", {128, 128, 128}},
    {"dark gray", {64, 64, 64}}};

/// Curves are near straight lines where both sides are coded as sRGB is.
double coded(double light) { return srgbOfLight(std::clamp(light, 0.0, 1.0)); }

/// Straight between its places, which ascend; the same beyond the ends.
double between(const std::vector<double>& x, const std::vector<double>& y, double at) {
  const auto above = std::upper_bound(x.begin(), x.end(), at);
  if (above == x.begin()) return y.front();
  if (above == x.end()) return y.back();
  const auto i = static_cast<std::size_t>(above - x.begin());
  return y[i - 1] + (at - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
}

double luminance(const Eigen::Vector3d& light) {
  return light.dot(Eigen::Vector3d(0.2126, 0.7152, 0.0722));
}

/// The values to send for light, channel by channel.
class ResponseInverse {
 public:
  explicit ResponseInverse(const ColorResponse& response) : response_(response) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      for (const double light : response.response[channel]) coded_[channel].push_back(coded(light));
      // Levels that give the same light cannot be told apart: the lowest is sent.
      for (std::size_t i = 1; i < coded_[channel].size(); ++i) {
        coded_[channel][i] = std::max(coded_[channel][i], coded_[channel][i - 1] + 1e-9);
      }
    }
  }

  std::uint8_t send(std::size_t channel, double light) const {
    const double level = between(coded_[channel], response_.levels, coded(light));
    return static_cast<std::uint8_t>(std::lround(level));
  }

 private:
  const ColorResponse& response_;
  std::array<std::vector<double>, 3> coded_;
};

/// A response made quick to turn round.
class ColorInverse {
 public:
  explicit ColorInverse(const ColorResponse& response)
      : response_(response),
        inverse_(response),
        M_light_seen_(response.M_seen_light.inverse()),
        white_(response.white()) {}

  SentColor send(const Rgb& wanted, double brightness) const {
    if (wanted == Rgb{}) return {};
    const Eigen::Vector3d target = brightness * lightOf(wanted);
    const Eigen::Vector3d light = needed(target);
    SentColor sent = sentFor(light, target);
    if (isPossible(light)) return sent;
    const Eigen::Vector3d gray = Eigen::Vector3d::Constant(luminance(target));
    if (!isPossible(needed(gray))) return sent;
    double possible = 1, not_possible = 0;
    for (int i = 0; i < 12; ++i) {
      const double middle = (possible + not_possible) / 2;
      const bool is = isPossible(needed(target + middle * (gray - target)));
      (is ? possible : not_possible) = middle;
    }
    const SentColor paler = sentFor(needed(target + possible * (gray - target)), target);
    return paler.off < sent.off ? paler : sent;
  }

 private:
  Eigen::Vector3d needed(const Eigen::Vector3d& wanted) const {
    return M_light_seen_ * (white_ * wanted - response_.dark);
  }

  static bool isPossible(const Eigen::Vector3d& light) {
    return light.minCoeff() >= -1e-6 && light.maxCoeff() <= 1 + 1e-6;
  }

  SentColor sentFor(const Eigen::Vector3d& light, const Eigen::Vector3d& target) const {
    SentColor sent;
    for (int i = 0; i < 3; ++i) {
      const auto channel = static_cast<std::size_t>(i);
      sent.sent[channel] = inverse_.send(channel, light[i]);
    }
    sent.off = colorDifference(labOf(response_.seen(sent.sent) / white_), labOf(target));
    return sent;
  }

  const ColorResponse& response_;
  ResponseInverse inverse_;
  Eigen::Matrix3d M_light_seen_;
  double white_;
};

std::string hexText(const Rgb& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

void requireExposure(const std::vector<ColorSample>& samples) {
  double brightest = 0;
  for (const ColorSample& sample : samples) {
    if (!sample.seen.allFinite()) throw ColorRefused("a color that was seen is no number");
    brightest = std::max(brightest, sample.seen.maxCoeff());
    if (sample.seen.maxCoeff() < kOverexposed) continue;
    throw ColorRefused("the photograph of " + hexText(sample.shown) +
                       " is overexposed: expose all shorter");
  }
  if (brightest < kUnderexposed) {
    throw ColorRefused("the photographs are too dark: expose all longer, or dim the room less");
  }
}

/// Returns each color once: the mean of those shown twice.
std::map<Rgb, Eigen::Vector3d> eachOnce(const std::vector<ColorSample>& samples) {
  double full = 0;
  for (const ColorSample& sample : samples) full = std::max(full, sample.seen.maxCoeff());
  std::map<Rgb, std::pair<Eigen::Vector3d, int>> sums;
  for (const ColorSample& sample : samples) {
    auto [entry, is_new] = sums.try_emplace(sample.shown, Eigen::Vector3d::Zero(), 0);
    auto& [sum, count] = entry->second;
    if (!is_new && (sum / count - sample.seen).cwiseAbs().maxCoeff() > kAdapted * full) {
      throw ColorRefused("two photographs of " + hexText(sample.shown) +
                         " differ: fix the camera's exposure, gain and white balance, keep the "
                         "room's light, and take all again");
    }
    sum += sample.seen;
    ++count;
  }
  std::map<Rgb, Eigen::Vector3d> colors;
  for (const auto& [shown, sum] : sums) colors[shown] = sum.first / sum.second;
  return colors;
}

/// The channel that alone is lit.
std::optional<std::size_t> onlyChannel(const Rgb& color) {
  std::optional<std::size_t> only;
  for (std::size_t i = 0; i < 3; ++i) {
    if (color[i] == 0) continue;
    if (only) return std::nullopt;
    only = i;
  }
  return only;
}

/// Light by level of one channel; not descending.
std::map<int, double> rampOf(const std::map<Rgb, Eigen::Vector3d>& colors, std::size_t channel,
                             ColorResponse& response) {
  Rgb full{};
  full[channel] = 255;
  const auto brightest = colors.find(full);
  if (brightest == colors.end()) throw ColorRefused("no photograph of " + hexText(full));
  const Eigen::Vector3d primary = brightest->second - response.dark;
  if (primary.maxCoeff() < kUnderexposed) {
    throw ColorRefused(fmt::format("{} gives no light that the camera sees", kChannels[channel]));
  }
  response.M_seen_light.col(static_cast<Eigen::Index>(channel)) = primary;
  std::map<int, double> ramp = {{0, 0.0}};
  for (const auto& [color, seen] : colors) {
    if (onlyChannel(color) != channel) continue;
    const double light = (seen - response.dark).dot(primary) / primary.squaredNorm();
    ramp[color[channel]] = std::clamp(light, ramp.rbegin()->second, 1.0);
  }
  ramp[255] = 1;
  if (ramp.size() > kFewestLevels) return ramp;
  throw ColorRefused(fmt::format("{} was photographed at {} levels, {} are needed",
                                 kChannels[channel], ramp.size() - 1, kFewestLevels));
}

/// All channels at all levels that any of them has.
void setResponses(ColorResponse& response, const std::array<std::map<int, double>, 3>& ramps) {
  std::map<int, double> all;
  for (const auto& ramp : ramps) all.insert(ramp.begin(), ramp.end());
  for (const auto& entry : all) response.levels.push_back(entry.first);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::vector<double> at, light;
    for (const auto& [level, value] : ramps[channel]) {
      at.push_back(level);
      light.push_back(coded(value));
    }
    for (const double level : response.levels) {
      response.response[channel].push_back(lightOfSrgb(between(at, light, level)));
    }
  }
}

double gammaOf(const ColorResponse& response, std::size_t channel) {
  double up = 0, down = 0;
  for (std::size_t i = 0; i < response.levels.size(); ++i) {
    const double light = response.response[channel][i], level = response.levels[i] / 255;
    if (light <= 0.001 || level >= 1) continue;
    const double weight = light * std::log(level);
    up += weight * std::log(light);
    down += weight * std::log(level);
  }
  return down > 0 || down < 0 ? up / down : 1;
}

void setChecks(ColorFit& fit, const std::map<Rgb, Eigen::Vector3d>& colors) {
  const double white = fit.response.white();
  std::vector<double> off;
  for (const auto& [color, seen] : colors) {
    if (!isCheck(color)) continue;
    off.push_back(
        colorDifference(labOf(fit.response.seen(color) / white), labOf(seen / white)));
  }
  fit.checks = static_cast<int>(off.size());
  if (off.empty()) return;
  std::sort(off.begin(), off.end());
  fit.check_median = off[off.size() / 2];
  fit.check_worst = off.back();
}

/// White is red, green and blue, unless the projector mixes more light in.
void requireAdding(const ColorResponse& response, const std::map<Rgb, Eigen::Vector3d>& colors) {
  const auto white = colors.find({255, 255, 255});
  if (white == colors.end()) throw ColorRefused("no photograph of white (#ffffff)");
  const double ratio = (white->second - response.dark).sum() / response.M_seen_light.sum();
  if (std::abs(ratio - 1) < kNotAdding) return;
  throw ColorRefused(fmt::format(
      "white is {} % {} than red, green and blue together: switch off what makes the projector's "
      "picture more brilliant (DLP: BrilliantColor) or saves its lamp, and photograph all again",
      fixedText(100 * std::abs(ratio - 1), 0), ratio > 1 ? "brighter" : "darker"));
}

void setReach(ColorFit& fit) {
  const ColorInverse inverse(fit.response);
  for (const auto& [name, color] : kNamed) fit.named.push_back({name, inverse.send(color, 1)});
  constexpr int kSteps = 9;
  int reached = 0, all = 0;
  for (int i = 1; i < kSteps * kSteps * kSteps; ++i) {  // without black
    Rgb color;
    int rest = i;
    for (std::uint8_t& value : color) {
      value = static_cast<std::uint8_t>(rest % kSteps * 255 / (kSteps - 1));
      rest /= kSteps;
    }
    ++all;
    if (inverse.send(color, 1).off < kReachedDifference) ++reached;
  }
  fit.share_reached = static_cast<double>(reached) / all;
}

void requireReach(const ColorResponse& response) {
  const Eigen::Matrix3d& M = response.M_seen_light;
  const double volume = M.colwise().norm().prod();
  if (!(std::abs(M.determinant()) > kLeastDeterminant * volume) || !(response.white() > 0)) {
    throw ColorRefused(
        "red, green and blue look too much alike on this surface: no gray can be mixed from them");
  }
}

std::string numbersText(const std::vector<double>& numbers) {
  std::vector<std::string> texts;
  for (const double number : numbers) texts.push_back(exactText(number));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::vector<double> readNumbers(const YamlSource& file, const YAML::Node& node,
                                const std::string& what, std::size_t count) {
  return file.numbers(node, what, count);
}

void readCurve(const YamlSource& file, const YAML::Node& node, std::size_t channel,
               ColorResponse& response) {
  const std::string what = std::string("'") + kChannels[channel] + "'";
  auto& curve = response.response[channel];
  curve = readNumbers(file, node, what, response.levels.size());
  const bool is_sound = curve.front() == 0 && curve.back() == 1 &&
                        std::is_sorted(curve.begin(), curve.end());
  if (!is_sound) file.refuse(node, what + " should ascend from 0 to 1");
}

}  // namespace

double lightOfSrgb(double coded) {
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}

double srgbOfLight(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

Eigen::Vector3d lightOf(const Rgb& color) {
  return {lightOfSrgb(color[0] / 255.0), lightOfSrgb(color[1] / 255.0),
          lightOfSrgb(color[2] / 255.0)};
}

Eigen::Vector3d labOf(const Eigen::Vector3d& light) {
  Eigen::Matrix3d to_xyz;  // IEC 61966-2-1
  to_xyz << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  const Eigen::Vector3d xyz = to_xyz * light, white = to_xyz.rowwise().sum();
  const double x = labCurve(xyz.x() / white.x()), y = labCurve(xyz.y() / white.y()),
               z = labCurve(xyz.z() / white.z());
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

double colorDifference(const Eigen::Vector3d& lab_a, const Eigen::Vector3d& lab_b) {
  const double mean_ab = (lab_a.tail<2>().norm() + lab_b.tail<2>().norm()) / 2;
  const double stretch = 1.5 - 0.5 * seventh(mean_ab);
  const double a1 = stretch * lab_a.y(), a2 = stretch * lab_b.y();
  const double C1 = std::hypot(a1, lab_a.z()), C2 = std::hypot(a2, lab_b.z());
  const double h1 = hue(a1, lab_a.z()), h2 = hue(a2, lab_b.z());
  const bool is_gray = C1 * C2 == 0;
  const double dL = lab_b.x() - lab_a.x(), dC = C2 - C1;
  const double dH = 2 * std::sqrt(C1 * C2) * std::sin(radians(hueStep(h1, h2, is_gray) / 2));
  const double L = (lab_a.x() + lab_b.x()) / 2, C = (C1 + C2) / 2, h = meanHue(h1, h2, is_gray);
  const double T = 1 - 0.17 * std::cos(radians(h - 30)) + 0.24 * std::cos(radians(2 * h)) +
                   0.32 * std::cos(radians(3 * h + 6)) - 0.20 * std::cos(radians(4 * h - 63));
  const double turn = 30 * std::exp(-std::pow((h - 275) / 25, 2));
  const double L50 = (L - 50) * (L - 50);
  const double SL = 1 + 0.015 * L50 / std::sqrt(20 + L50), SC = 1 + 0.045 * C;
  const double SH = 1 + 0.015 * C * T;
  const double RT = -std::sin(radians(2 * turn)) * 2 * seventh(C);
  const double l = dL / SL, c = dC / SC, H = dH / SH;
  return std::sqrt(std::max(0.0, l * l + c * c + H * H + RT * c * H));
}

Eigen::Vector3d ColorResponse::light(const Rgb& sent) const {
  Eigen::Vector3d light;
  for (int i = 0; i < 3; ++i) {
    const auto channel = static_cast<std::size_t>(i);
    const auto above = std::upper_bound(levels.begin(), levels.end(), double(sent[channel]));
    if (above == levels.end()) {
      light[i] = response[channel].back();
      continue;
    }
    const auto k = static_cast<std::size_t>(above - levels.begin());
    const double share = (sent[channel] - levels[k - 1]) / (levels[k] - levels[k - 1]);
    const double below = coded(response[channel][k - 1]);
    light[i] = lightOfSrgb(below + share * (coded(response[channel][k]) - below));
  }
  return light;
}

std::array<std::vector<std::uint8_t>, 3> ColorResponse::valuesToSend(int count) const {
  const ResponseInverse inverse(*this);
  std::array<std::vector<std::uint8_t>, 3> values;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (int i = 0; i < count; ++i) {
      values[channel].push_back(inverse.send(channel, static_cast<double>(i) / (count - 1)));
    }
  }
  return values;
}

double ColorResponse::white() const {
  const Eigen::Matrix3d M_light_seen = M_seen_light.inverse();
  return brightestGray(M_light_seen, M_light_seen * dark);
}

double brightestGray(const Eigen::Matrix3d& M_light_seen, const Eigen::Vector3d& in_dark,
                     double most) {
  // The light of gray g is g * per_gray - in_dark; each channel's ends at `most`.
  const Eigen::Vector3d per_gray = M_light_seen.rowwise().sum();
  if (!per_gray.allFinite() || per_gray.minCoeff() <= 0) return 0;
  const double gray = ((in_dark.array() + most) / per_gray.array()).minCoeff();
  const Eigen::Vector3d light = gray * per_gray - in_dark;
  return light.minCoeff() >= 0 ? gray : 0;
}

double ColorResponse::whiteShare() const {
  return (white() - luminance(dark)) / luminance(M_seen_light * Eigen::Vector3d::Ones());
}

SentColor colorToSend(const ColorResponse& response, const Rgb& wanted, double brightness) {
  return ColorInverse(response).send(wanted, brightness);
}

std::vector<std::uint8_t> colorTable(const ColorResponse& response, double brightness) {
  const ColorInverse inverse(response);
  std::vector<std::uint8_t> table;
  const auto value = [](int step) {
    return static_cast<std::uint8_t>(std::lround(step * 255.0 / (kColorTableSide - 1)));
  };
  for (int b = 0; b < kColorTableSide; ++b) {
    for (int g = 0; g < kColorTableSide; ++g) {
      for (int r = 0; r < kColorTableSide; ++r) {
        const Rgb sent = inverse.send({value(r), value(g), value(b)}, brightness).sent;
        table.insert(table.end(), sent.begin(), sent.end());
      }
    }
  }
  return table;
}

std::vector<Rgb> colorsToShow() {
  std::vector<Rgb> colors = {{0, 0, 0}, {255, 255, 255}};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (const std::uint8_t level : {32, 64, 96, 128, 160, 192, 224, 255}) {
      Rgb color{};
      color[channel] = level;
      colors.push_back(color);
    }
  }
  for (const Rgb& check : std::vector<Rgb>{{64, 64, 64}, {128, 128, 128}, {192, 192, 192},
                                           {255, 255, 0}, {0, 255, 255}, {255, 0, 255},
                                           {255, 128, 48}, {96, 160, 80}}) {
    colors.push_back(check);
  }
  colors.push_back({0, 0, 0});
  colors.push_back({255, 255, 255});
  return colors;
}

bool isCheck(const Rgb& color) {
  const auto lit = std::count_if(color.begin(), color.end(), [](int value) { return value > 0; });
  return lit > 1 && color != Rgb{255, 255, 255};
}

std::string checksText(int checks, double median, const std::string& most, double off) {
  if (checks == 0) return "No mixed color was photographed: nothing says how right this is.";
  return fmt::format(
      "{} mixed colors that were not fitted to\n"
      "are seen {:.1f} from where they are expected ({}: {:.1f}).",
      checks, median, most, off);
}

ColorFit fitColor(const std::vector<ColorSample>& samples) {
  requireExposure(samples);
  const auto colors = eachOnce(samples);
  const auto black = colors.find(Rgb{});
  if (black == colors.end()) throw ColorRefused("no photograph of black (#000000)");
  ColorFit fit;
  fit.response.dark = black->second;
  std::array<std::map<int, double>, 3> ramps;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    ramps[channel] = rampOf(colors, channel, fit.response);
  }
  setResponses(fit.response, ramps);
  requireAdding(fit.response, colors);
  requireReach(fit.response);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    fit.gamma[channel] = gammaOf(fit.response, channel);
  }
  setChecks(fit, colors);
  setReach(fit);
  return fit;
}

std::string colorYaml(const ColorFit& fit) {
  return "# How the projector's colors look on a surface, by `afterglow calibrate color`; `color` "
         "of\n"
         "# a projector's configuration names this file. seen = dark + M_seen_light * response.\n" +
         responseYaml(fit.response);
}

std::string responseYaml(const ColorResponse& response) {
  std::string text = "levels: " + numbersText(response.levels) + "\n";
  for (std::size_t channel = 0; channel < 3; ++channel) {
    text += std::string(kChannels[channel]) + ": " + numbersText(response.response[channel]) + "\n";
  }
  text += "M_seen_light:\n";
  for (int row = 0; row < 3; ++row) {
    const Eigen::Vector3d r = response.M_seen_light.row(row);
    text += "  - " + numbersText({r.x(), r.y(), r.z()}) + "\n";
  }
  const Eigen::Vector3d& dark = response.dark;
  return text + "dark: " + numbersText({dark.x(), dark.y(), dark.z()}) + "\n";
}

ColorResponse loadColor(const std::string& path) {
  return readResponse(YamlSource(path), "a color calibration", {});
}

ColorResponse readResponse(const YamlSource& file, const std::string& what,
                           const std::vector<std::string>& other_keys) {
  std::vector<std::string> keys = {"levels", "red", "green", "blue", "M_seen_light", "dark"};
  keys.insert(keys.end(), other_keys.begin(), other_keys.end());
  file.requireKeys(file.root(), what, keys);
  const auto at = [&](const char* key) { return file.at(file.root(), key, what); };
  ColorResponse response;
  const YAML::Node levels = at("levels"), rows = at("M_seen_light");
  if (!levels.IsSequence() || levels.size() < 2 || levels.size() > 256) {
    file.refuse(levels, "'levels' should be 2 to 256 numbers");
  }
  response.levels = readNumbers(file, levels, "'levels'", levels.size());
  const auto& l = response.levels;
  const bool ascends = std::adjacent_find(l.begin(), l.end(), std::greater_equal<>()) == l.end();
  if (!ascends || l.front() != 0 || l.back() != 255) {
    file.refuse(levels, "'levels' should ascend from 0 to 255");
  }
  for (std::size_t i = 0; i < 3; ++i) readCurve(file, at(kChannels[i]), i, response);
  if (!rows.IsSequence() || rows.size() != 3) file.refuse(rows, "'M_seen_light' has three rows");
  for (std::size_t row = 0; row < 3; ++row) {
    const auto numbers = readNumbers(file, rows[row], "a row of 'M_seen_light'", 3);
    for (std::size_t i = 0; i < 3; ++i) {
      response.M_seen_light(static_cast<int>(row), static_cast<int>(i)) = numbers[i];
    }
  }
  const auto dark = readNumbers(file, at("dark"), "'dark'", 3);
  response.dark = {dark[0], dark[1], dark[2]};
  try {
    requireReach(response);
  } catch (const ColorRefused& refused) {
    file.refuse(rows, refused.what());
  }
  return response;
}

}  // namespace afterglow::calib
