// Colors on wood, tiles and a carpet, judged by the referee of support/textured_room.hpp.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "calib/color/texture_photographs.hpp"
#include "render/light_output.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/texture_trial.hpp"

namespace afterglow::render::texture_referee_test {
namespace {

using test::judge;
using test::lensOf;
using test::RoomOptics;
using test::RoomSurface;
using test::TexturedRoom;
using test::Verdict;

/// Of World, which is the surface's frame here.
Rigid<Projector, World> poseOf(const RoomOptics& optics) {
  return Rigid<Projector, World>(optics.T_optical_surface);
}

calib::TextureFit calibrated(TexturedRoom& room, const std::string& folder, bool has_flat = true) {
  const std::string photographs = folder + "/photographs";
  std::filesystem::create_directories(photographs);
  room.open();
  int number = 0;
  for (const calib::Rgb& color : calib::colorsToShow()) {
    char name[64];
    std::snprintf(name, sizeof(name), "/%02d_%02x%02x%02x.png", number++, color[0], color[1],
                  color[2]);
    cv::imwrite(photographs + name, room.photograph(color), {cv::IMWRITE_PNG_COMPRESSION, 1});
  }
  calib::TextureOptions options;
  options.surface = "floor";
  if (has_flat) {
    options.flat = folder + "/flat.png";
    cv::imwrite(options.flat, room.photographFlat());
  }
  const calib::TextureView view{lensOf(room.camera), lensOf(room.projector),
                                Rigid<Camera, Surface>(room.camera.T_optical_surface),
                                Rigid<Projector, Surface>(room.projector.T_optical_surface)};
  return calib::fitTexture(photographs, view, options);
}

const std::vector<calib::Rgb> kAsked = {{255, 255, 255}, {188, 188, 188}, {128, 128, 128},
                                        {220, 160, 140}, {150, 200, 150}, {150, 160, 210},
                                        {230, 220, 150}, {240, 190, 230}, {255, 140, 100},
                                        {120, 220, 220}, {110, 90, 160},  {90, 140, 90}};

Image evenImage(const RoomOptics& optics, const calib::Rgb& color) {
  Image image{optics.width, optics.height, {}};
  for (int i = 0; i < optics.width * optics.height; ++i) {
    image.rgb.insert(image.rgb.end(), color.begin(), color.end());
  }
  return image;
}

struct Judged {
  Verdict before, after;
  double reachable = 0;
};

Judged judgeAll(const TexturedRoom& room, const calib::SurfaceTexture& texture) {
  LightSettings settings;
  settings.textures = {texture};
  LightOutput output(settings, lensOf(room.projector));
  const std::vector<SurfacePatch> surfaces = {{"floor", {}, {}}};
  // Uncompensated, white is what it is in the middle of all places: only evenness and tint are
  // judged.
  const calib::Rgb full = {255, 255, 255};
  const double plain_white = test::medianWhite(room, full, evenImage(room.projector, full));
  Judged judged;
  for (const calib::Rgb& color : kAsked) {
    const Image drawn = evenImage(room.projector, color);
    Image sent = drawn;
    output.apply(sent, surfaces, poseOf(room.projector));
    const double white = output.textureReports().at(0).white / room.exposure;
    const Verdict after = judge(room, texture, white, color, sent, white);
    const Verdict before = judge(room, texture, plain_white, color, drawn, white);
    judged.after.off.insert(judged.after.off.end(), after.off.begin(), after.off.end());
    judged.before.off.insert(judged.before.off.end(), before.off.begin(), before.off.end());
    judged.reachable += after.reachable / static_cast<double>(kAsked.size());
  }
  return judged;
}

/// Where AFTERGLOW_TEXTURE_PICTURES names a folder: what somebody sees of colored fields, without
/// and with compensation.
void savePictures(const TexturedRoom& room, const calib::SurfaceTexture& texture,
                  const std::string& name) {
  const char* const folder = std::getenv("AFTERGLOW_TEXTURE_PICTURES");
  if (folder == nullptr) return;
  Image drawn{room.projector.width, room.projector.height, {}};
  for (int y = 0; y < drawn.height; ++y) {
    for (int x = 0; x < drawn.width; ++x) {
      const int field = std::min(x / 320, 3) + 4 * std::min(y / 267, 2);
      const calib::Rgb& color = kAsked[static_cast<std::size_t>(field)];
      drawn.rgb.insert(drawn.rgb.end(), color.begin(), color.end());
    }
  }
  LightSettings settings;
  settings.textures = {texture};
  LightOutput output(settings, lensOf(room.projector));
  Image sent = drawn;
  output.apply(sent, {{"floor", {}, {}}}, poseOf(room.projector));
  const double white = output.textureReports().at(0).white / room.exposure;
  cv::Mat both;
  cv::hconcat(room.picture(drawn.rgb, 1), room.picture(sent.rgb, 1.25 * white), both);
  cv::imwrite(std::string(folder) + "/" + name + ".png", both);
}

class Textures : public testing::TestWithParam<RoomSurface> {};

TEST_P(Textures, lookAsAskedForAlsoAfterTheProjectorHasMoved) {
  const std::string name = GetParam() == RoomSurface::Wood    ? "wood"
                           : GetParam() == RoomSurface::Tiles ? "tiles"
                                                              : "carpet";
  TexturedRoom room = test::roomWith(GetParam());
  const test::TempFolder folder;
  const calib::TextureFit fit = calibrated(room, folder.path("."));
  std::printf(
      "%s: cells of %.2f mm, %d x %d, known %.3f; checks %.2f (95 %%: %.2f); white %.3f "
      "(median gray %.3f); colors within reach %.2f\n",
      name.c_str(), 1000 * fit.texture.cell, fit.texture.columns, fit.texture.rows, fit.known_share,
      fit.check_median, fit.check_p95, fit.white, fit.median_gray, fit.share_reached);
  EXPECT_GT(fit.known_share, 0.9);
  for (const std::string moment : {"there", "moved"}) {
    Judged judged = judgeAll(room, fit.texture);
    std::printf("%s, %s: %.0f %% within reach; before %.2f (%.2f), after %.2f (%.2f)\n",
                name.c_str(), moment.c_str(), 100 * judged.reachable, judged.before.median(),
                judged.before.p95(), judged.after.median(), judged.after.p95());
    EXPECT_GT(judged.reachable, 0.5);
    EXPECT_LE(judged.after.median(), 3);
    EXPECT_LE(judged.after.p95(), 6);
    EXPECT_GT(judged.before.median(), 3 * judged.after.median());
    savePictures(room, fit.texture, name + "_" + moment);
    test::moveProjector(room);
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Textures,
                         testing::Values(RoomSurface::Wood, RoomSurface::Tiles,
                                         RoomSurface::Carpet));

/// The table of Sharma, Wu and Dalal 2005, all 34 pairs.
TEST(RefereeDifference, isThatOfTheArticle) {
  const double pairs[][7] = {{50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425},
                             {50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615},
                             {50, 2.8361, -74.0200, 50, 0, -82.7485, 3.4412},
                             {50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000},
                             {50, -1.1848, -84.8006, 50, 0, -82.7485, 1.0000},
                             {50, -0.9009, -85.5211, 50, 0, -82.7485, 1.0000},
                             {50, 0, 0, 50, -1, 2, 2.3669},
                             {50, -1, 2, 50, 0, 0, 2.3669},
                             {50, 2.4900, -0.0010, 50, -2.4900, 0.0009, 7.1792},
                             {50, 2.4900, -0.0010, 50, -2.4900, 0.0010, 7.1792},
                             {50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195},
                             {50, 2.4900, -0.0010, 50, -2.4900, 0.0012, 7.2195},
                             {50, -0.0010, 2.4900, 50, 0.0009, -2.4900, 4.8045},
                             {50, -0.0010, 2.4900, 50, 0.0010, -2.4900, 4.8045},
                             {50, -0.0010, 2.4900, 50, 0.0011, -2.4900, 4.7461},
                             {50, 2.5, 0, 50, 0, -2.5, 4.3065},
                             {50, 2.5, 0, 73, 25, -18, 27.1492},
                             {50, 2.5, 0, 61, -5, 29, 22.8977},
                             {50, 2.5, 0, 56, -27, -3, 31.9030},
                             {50, 2.5, 0, 58, 24, 15, 19.4535},
                             {50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000},
                             {50, 2.5, 0, 50, 3.2972, 0, 1.0000},
                             {50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000},
                             {50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000},
                             {60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644},
                             {63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630},
                             {61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731},
                             {35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645},
                             {22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373},
                             {36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146},
                             {90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441},
                             {90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381},
                             {6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377},
                             {2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082}};
  for (const auto& p : pairs) {
    EXPECT_NEAR(test::refereeDifference({p[0], p[1], p[2]}, {p[3], p[4], p[5]}), p[6], 5e-5)
        << p[1];
    EXPECT_NEAR(calib::colorDifference({p[0], p[1], p[2]}, {p[3], p[4], p[5]}), p[6], 5e-5) << p[1];
  }
}

}  // namespace
}  // namespace afterglow::render::texture_referee_test
