#include "calib/color/texture.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "calib/picture.hpp"
#include "calib/yaml_source.hpp"

namespace afterglow::calib {
namespace {

namespace fs = std::filesystem;

constexpr double kFarthest = 1000, kLeastCell = 1e-4, kGreatestCell = 1;  // m
constexpr int kPanels = 4;
constexpr double kFullCount = 65535;

/// Dark, red, green or blue of a cell, in the order of the picture's panels.
Eigen::Vector3f panelOf(const TextureCell& cell, int panel) {
  return panel == 0 ? cell.dark : Eigen::Vector3f(cell.M_seen_light.col(panel - 1));
}

/// The place of a cell in a panel: y is up.
cv::Vec3w& placeIn(cv::Mat& picture, const SurfaceTexture& texture, int panel, int column,
                   int row) {
  return picture.at<cv::Vec3w>(panel * texture.rows + texture.rows - 1 - row, column);
}

double lightOfCount(const SurfaceTexture& texture, int panel) {
  float most = 0;
  for (const TextureCell& cell : texture.cells)
    most = std::max(most, panelOf(cell, panel).maxCoeff());
  return most > 0 ? most / kFullCount : 1 / kFullCount;
}

/// OpenCV's pictures have blue first.
cv::Mat pictureOf(const SurfaceTexture& texture, const std::vector<double>& scales) {
  cv::Mat picture(kPanels * texture.rows, texture.columns, CV_16UC3);
  for (int panel = 0; panel < kPanels; ++panel) {
    for (int row = 0; row < texture.rows; ++row) {
      for (int column = 0; column < texture.columns; ++column) {
        const Eigen::Vector3f light = panelOf(texture.at(column, row), panel);
        cv::Vec3w& place = placeIn(picture, texture, panel, column, row);
        for (int i = 0; i < 3; ++i) {
          place[2 - i] =
              cv::saturate_cast<std::uint16_t>(light[i] / scales[static_cast<std::size_t>(panel)]);
        }
      }
    }
  }
  return picture;
}

void readPicture(cv::Mat& picture, const std::vector<double>& scales, SurfaceTexture& texture) {
  texture.cells.resize(picture.total() / kPanels);
  for (int row = 0; row < texture.rows; ++row) {
    for (int column = 0; column < texture.columns; ++column) {
      auto& cell = texture.cells[static_cast<std::size_t>(row * texture.columns + column)];
      for (int panel = 0; panel < kPanels; ++panel) {
        const cv::Vec3w& place = placeIn(picture, texture, panel, column, row);
        const Eigen::Vector3f light = Eigen::Vector3d(place[2], place[1], place[0]).cast<float>() *
                                      static_cast<float>(scales[static_cast<std::size_t>(panel)]);
        if (panel == 0) {
          cell.dark = light;
        } else {
          cell.M_seen_light.col(panel - 1) = light;
        }
      }
    }
  }
}

bool isFileName(const std::string& name) {
  const auto isFit = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  };
  return !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), isFit);
}

double positive(const YamlSource& file, const YAML::Node& node, const std::string& what,
                double least, double greatest) {
  const double number = file.number(node, what);
  if (!(number >= least && number <= greatest)) {
    file.refuse(node, fmt::format("{} goes from {:g} to {:g}", what, least, greatest));
  }
  return number;
}

}  // namespace

TextureCell SurfaceTexture::mean() const {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Vector3d dark = Eigen::Vector3d::Zero();
  double known = 0;
  for (const TextureCell& one : cells) {
    if (!one.isKnown()) continue;
    M += one.M_seen_light.cast<double>();
    dark += one.dark.cast<double>();
    ++known;
  }
  if (known == 0) return {};
  return {(M / known).cast<float>(), (dark / known).cast<float>()};
}

double lightDensity(const Lens& projector, const Eigen::Vector3d& p_optical,
                    const Eigen::Vector3d& n_optical) {
  const double z = p_optical.z();
  if (!(z > 0)) return 0;
  // A small piece of a plane at distance h from the lens is seen h / z^3 as large at z = 1; pixels
  // lie there as the lens spreads them.
  const PixelSlope slope = pixelSlope(projector, p_optical.head<2>() / z);
  const double pixels = std::abs(slope.by_ray.determinant());
  return std::abs(n_optical.dot(p_optical)) / (z * z * z) * pixels /
         (static_cast<double>(projector.width) * projector.height);
}

double evenWhite(std::vector<double> brightest_grays) {
  if (brightest_grays.empty()) return 0;
  const auto at =
      brightest_grays.begin() +
      static_cast<std::ptrdiff_t>(kTooDark * static_cast<double>(brightest_grays.size()));
  std::nth_element(brightest_grays.begin(), at, brightest_grays.end());
  return *at;
}

std::string saveTexture(const std::string& folder, const SurfaceTexture& texture) {
  const std::string name = texture.surface + "_texture";
  if (!isFileName(name)) {
    throw std::invalid_argument("'" + texture.surface + "' cannot be part of a file's name");
  }
  std::vector<double> scales;
  for (int panel = 0; panel < kPanels; ++panel) scales.push_back(lightOfCount(texture, panel));
  std::vector<std::uint8_t> png;
  cv::imencode(".png", pictureOf(texture, scales), png);
  const Eigen::Map<const Eigen::RowVectorXd> scale_row(scales.data(), kPanels);
  const std::string yaml = fmt::format(
      "# How the projector's colors look on a surface, cell by cell, by `afterglow calibrate\n"
      "# texture`; `textures` of a projector's configuration names this file. At a place that "
      "gets\n"
      "# this density of the projector's light (share of a picture's light, 1 / m^2)\n"
      "# seen = dark + M_seen_light * response. picture: dark, red, green and blue from top to\n"
      "# bottom, x to the right and y up, times scale; without light: not photographed.\n"
      "surface: {}\norigin: {}\ncell: {}\ncolumns: {}\nrows: {}\ndensity: {}\n"
      "picture: {}.png\nscale: {}\n{}",
      yamlText(texture.surface), yamlNumbers(texture.origin.transpose()), exactText(texture.cell),
      texture.columns, texture.rows, exactText(texture.density), name, yamlNumbers(scale_row),
      responseYaml(texture.color));
  const fs::path path = fs::path(folder) / (name + ".yaml");
  FileReplacement files;
  files.add((fs::path(folder) / (name + ".png")).string(), std::string(png.begin(), png.end()));
  files.add(path.string(), yaml);
  files.commit();
  return path.string();
}

SurfaceTexture loadTexture(const std::string& path) {
  const YamlSource file(path);
  const std::string what = "a texture calibration";
  SurfaceTexture texture;
  texture.color = readResponse(
      file, what, {"surface", "origin", "cell", "columns", "rows", "density", "picture", "scale"});
  const auto at = [&](const char* key) { return file.at(file.root(), key, what); };
  texture.surface = file.text(at("surface"), "'surface'");
  const auto origin = file.numbers(at("origin"), "'origin'", 2);
  texture.origin = {origin[0], origin[1]};
  if (texture.origin.cwiseAbs().maxCoeff() > kFarthest) {
    file.refuse(at("origin"), "'origin' is more than 1000 m away");
  }
  texture.cell = positive(file, at("cell"), "'cell'", kLeastCell, kGreatestCell);
  texture.density = positive(file, at("density"), "'density'", 1e-9, 1e9);
  texture.columns = file.integer(at("columns"), "'columns'");
  texture.rows = file.integer(at("rows"), "'rows'");
  if (texture.columns < 1 || texture.rows < 1 ||
      texture.columns > kMostTextureCells / texture.rows) {
    file.refuse(at("columns"),
                fmt::format("'columns' times 'rows' goes from 1 to {}", kMostTextureCells));
  }
  if (std::max(texture.columns, texture.rows) > kMostTextureSide) {
    file.refuse(at("columns"), fmt::format("'columns' and 'rows' go up to {}", kMostTextureSide));
  }
  const std::vector<double> scales = file.numbers(at("scale"), "'scale'", kPanels);
  for (const double scale : scales) {
    if (!(scale > 0 && scale <= 1)) file.refuse(at("scale"), "'scale' goes from 0 to 1");
  }
  const std::string name = file.text(at("picture"), "'picture'");
  if (!isFileName(name)) file.refuse(at("picture"), "'picture' names a file of the same folder");
  const std::string picture_path = (fs::path(path).parent_path() / name).string();
  cv::Mat picture = readPhotograph(picture_path, cv::IMREAD_UNCHANGED);
  if (picture.type() != CV_16UC3 || picture.cols != texture.columns ||
      picture.rows != kPanels * texture.rows) {
    throw std::runtime_error(
        fmt::format("{}: should have {} x {} pixels of three channels and 16 "
                    "bits, as {} says",
                    picture_path, texture.columns, kPanels * texture.rows, path));
  }
  readPicture(picture, scales, texture);
  if (!texture.mean().isKnown()) throw std::runtime_error(picture_path + ": no cell is known");
  return texture;
}

}  // namespace afterglow::calib
