/// \file
/// Small images that were looked at and are kept. AFTERGLOW_UPDATE_GOLDENS=1 writes them anew; look
/// at them before they are committed. Of a failure the image, and the difference times 8, are left
/// in the folder for temporary files.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "render/compose/light_composer.hpp"
#include "render/paint/cpu_drawer.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::test {

constexpr int kGoldenWidth = 160, kGoldenHeight = 120;
/// A bent lens.
inline calib::Lens goldenLens() {
  return lens(kGoldenWidth, kGoldenHeight, 140, 79.5, 59.5, {-0.15, 0.03, 0.001, -0.001, 0});
}

/// The scene as the CPU paints it for a projector there.
inline render::Image painted(const render::Scene& scene,
                             const Rigid<Projector, World>& T_projector_world = {}) {
  render::LightComposer composer(goldenLens());
  render::Image image{kGoldenWidth, kGoldenHeight, {}};
  image.rgb.resize(std::size_t{3} * kGoldenWidth * kGoldenHeight);
  render::CpuDrawer(goldenLens()).draw(composer.compose(scene, T_projector_world), image);
  return image;
}

/// Compares the painted scene with a kept image.
inline void expectGolden(const std::string& path, const render::Scene& scene,
                         const Rigid<Projector, World>& T_projector_world = {}) {
  // Of 255, at an edge: another compiler may round a vertex elsewhere.
  constexpr double kLargest = 16, kMean = 0.05;
  render::Image drawn = painted(scene, T_projector_world);
  cv::Mat image;
  cv::cvtColor(cv::Mat(kGoldenHeight, kGoldenWidth, CV_8UC3, drawn.rgb.data()), image,
               cv::COLOR_RGB2BGR);
  if (std::getenv("AFTERGLOW_UPDATE_GOLDENS") != nullptr) cv::imwrite(path, image);
  const cv::Mat golden = cv::imread(path, cv::IMREAD_COLOR);
  ASSERT_EQ(golden.size(), image.size()) << path;
  cv::Mat difference;
  cv::absdiff(image, golden, difference);
  double largest = 0;
  cv::minMaxLoc(difference.reshape(1), nullptr, &largest);
  const cv::Scalar means = cv::mean(difference);
  const double mean = (means[0] + means[1] + means[2]) / 3;
  EXPECT_LE(largest, kLargest) << path;
  EXPECT_LE(mean, kMean) << path;
  if (largest <= kLargest && mean <= kMean) return;
  const auto folder = std::filesystem::temp_directory_path();
  const std::string name = std::filesystem::path(path).stem().string();
  cv::imwrite((folder / (name + "_is.png")).string(), image);
  cv::imwrite((folder / (name + "_difference.png")).string(), difference * 8);
}

}  // namespace afterglow::test
