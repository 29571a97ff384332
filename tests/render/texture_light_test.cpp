#include "render/texture_light.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include "render/light_output.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::render::texture_light_test {
namespace {

/// 2 m over the floor, looking straight down, 64 x 48 pixels of 1 cm.
const calib::Lens kLens = test::lens(64, 48, 200, 31.5, 23.5);
const Rigid<Projector, World> kPose =
    test::lookAt<Projector>({0, 0, 2}, {0, 0, 0}, Eigen::Vector3d::UnitY()).inverse();

/// 0.8 m x 0.8 m around the origin in cells of 1 cm; x < 0 reflects half as much red.
calib::SurfaceTexture halves() {
  calib::SurfaceTexture texture;
  texture.surface = "floor";
  texture.color.levels = {0, 255};
  texture.color.response.fill({0, 1});
  texture.origin = {-0.4, -0.4};
  texture.cell = 0.01;
  texture.columns = texture.rows = 80;
  texture.density = calib::lightDensity(kLens, Eigen::Vector3d(0, 0, 2), Eigen::Vector3d::UnitZ());
  for (int i = 0; i < 80 * 80; ++i) {
    Eigen::Vector3f albedo(0.8f, 0.8f, 0.8f);
    if (i % 80 < 40) albedo.x() = 0.4f;
    texture.cells.push_back({albedo.asDiagonal(), {0, 0, 0}});
  }
  return texture;
}

Image even(const calib::Rgb& color) {
  Image image{64, 48, {}};
  for (int i = 0; i < 64 * 48; ++i) image.rgb.insert(image.rgb.end(), color.begin(), color.end());
  return image;
}

calib::Rgb at(const Image& image, int x, int y) {
  const std::uint8_t* const pixel = &image.rgb[static_cast<std::size_t>(3 * (y * 64 + x))];
  return {pixel[0], pixel[1], pixel[2]};
}

/// Of a projector whose response is straight between sRGB's codes of 0 and 1: sRGB.
int valueOf(double light) { return static_cast<int>(std::lround(255 * calib::srgbOfLight(light))); }

LightOutput outputOf(const calib::SurfaceTexture& texture, LightSettings settings = {}) {
  settings.textures = {texture};
  return LightOutput(settings, kLens);
}

TEST(TextureLight, isTheSameWhiteOnBothHalves) {
  LightOutput output = outputOf(halves());
  Image image = even({255, 255, 255});
  output.apply(image, {{"floor", {}, {}}}, kPose);
  const calib::Rgb dark = at(image, 10, 20), bright = at(image, 50, 20);
  // White is what the dark half can show.
  EXPECT_NEAR(dark[0], 255, 1);
  EXPECT_NEAR(dark[1], valueOf(0.5), 1);
  EXPECT_NEAR(bright[0], valueOf(0.5), 1);
  EXPECT_NEAR(bright[1], valueOf(0.5), 1);
  const TextureReport report = output.textureReports().at(0);
  EXPECT_NEAR(report.white, 0.4, 0.01);
  EXPECT_EQ(report.lit, 64u * 48);
  EXPECT_EQ(report.clipped, 0u);
  EXPECT_EQ(report.unknown, 0u);
}

TEST(TextureLight, staysInItsPlaceWhenTheProjectorMoves) {
  LightOutput output = outputOf(halves());
  Eigen::Isometry3d T = kPose.matrix();
  T.pretranslate(Eigen::Vector3d(-0.1, 0, 0));  // the floor goes ten pixels to the left
  Image image = even({255, 255, 255});
  output.apply(image, {{"floor", {}, {}}}, Rigid<Projector, World>(T));
  EXPECT_NEAR(at(image, 21, 20)[0], 255, 1);
  EXPECT_NEAR(at(image, 22, 20)[0], valueOf(0.5), 1);
}

TEST(TextureLight, sendsMoreLightFromFartherAway) {
  const calib::SurfaceTexture texture = halves();
  LightOutput output = outputOf(texture);
  Eigen::Isometry3d T = kPose.matrix();
  T.pretranslate(Eigen::Vector3d(0, 0, -1));  // 1 m over the floor: four times the light
  Image image = even({255, 255, 255});
  output.apply(image, {{"floor", {}, {}}}, Rigid<Projector, World>(T));
  EXPECT_NEAR(output.textureReports().at(0).white, 1.6, 0.03);
}

TEST(TextureLight, leavesBlackAndOtherSurfacesAlone) {
  LightSettings settings;
  settings.gamma = {1, 1, 1};
  LightOutput output = outputOf(halves(), settings);
  Image image = even({255, 255, 255});
  std::fill_n(image.rgb.begin(), 3 * 64, std::uint8_t{0});
  Eigen::Isometry3d table = Eigen::Isometry3d::Identity();
  table.translation().z() = 1;
  const std::vector<SurfacePatch> surfaces = {
      {"floor", {}, {}},
      {"table", Rigid<World, Surface>(table), {{0, -1}, {0.05, -1}, {0.05, 1}, {0, 1}}}};
  for (std::size_t i = 3 * 64; i < image.rgb.size(); ++i) image.rgb[i] = 128;
  Image drawn = image;
  output.apply(image, surfaces, kPose);
  EXPECT_EQ(at(image, 20, 0), (calib::Rgb{0, 0, 0}));
  // The table's light goes by gamma; its edges run through blocks.
  const int by_gamma = static_cast<int>(std::lround(255 * calib::lightOfSrgb(128 / 255.0)));
  for (int x = 32; x <= 41; ++x) EXPECT_EQ(at(image, x, 30)[1], by_gamma) << x;
  EXPECT_NE(at(image, 31, 30)[1], by_gamma);
  EXPECT_NE(at(image, 42, 30)[1], by_gamma);
  // A surface without texture goes by gamma alone.
  output.apply(drawn, {{"wall", {}, {}}}, kPose);
  EXPECT_EQ(at(drawn, 20, 20)[0], by_gamma);
}

TEST(TextureLight, takesTheMeanWhereNothingWasPhotographedAndTellsSo) {
  calib::SurfaceTexture texture = halves();
  for (int i = 0; i < 80 * 80; ++i) {
    if (i % 80 >= 60) texture.cells[static_cast<std::size_t>(i)] = {};
  }
  LightOutput output = outputOf(texture);
  Image image = even({255, 255, 255});
  output.apply(image, {{"floor", {}, {}}}, kPose);
  const TextureReport report = output.textureReports().at(0);
  EXPECT_NEAR(static_cast<double>(report.unknown) / static_cast<double>(report.lit), 12.0 / 64,
              0.02);
  const double mean = (40 * 0.4 + 20 * 0.8) / 60;
  EXPECT_NEAR(at(image, 60, 20)[0], valueOf(0.4 / mean), 2);
  EXPECT_NE(textureWords(report).find("% falls where it was not photographed"), std::string::npos);
}

TEST(TextureLight, tellsWhatIsOutOfReach) {
  calib::SurfaceTexture texture = halves();
  for (calib::TextureCell& cell : texture.cells) cell.dark = {0.1f, 0.1f, 0.1f};
  LightOutput output = outputOf(texture);
  Image image = even({255, 0, 0});  // the room's own green and blue cannot be taken away
  output.apply(image, {{"floor", {}, {}}}, kPose);
  const TextureReport report = output.textureReports().at(0);
  EXPECT_EQ(report.clipped, report.lit);
  EXPECT_EQ(at(image, 20, 20)[1], 0);
}

TEST(TextureLight, isMirroredAfterwardsAndDimmed) {
  LightSettings settings;
  settings.mirror = Mirror::Horizontal;
  settings.max_brightness = 0.5;
  LightOutput output = outputOf(halves(), settings);
  Image image = even({255, 255, 255});
  output.apply(image, {{"floor", {}, {}}}, kPose);
  EXPECT_NEAR(at(image, 53, 20)[0], valueOf(0.5), 1);
  EXPECT_NEAR(at(image, 13, 20)[0], valueOf(0.25), 1);
}

TEST(TextureLight, sendsAnImageAfterOthersAsIfItWereTheFirst) {
  const calib::SurfaceTexture texture = halves();
  LightOutput output = outputOf(texture);
  Eigen::Isometry3d T = kPose.matrix();
  Image drawn = even({0, 0, 0});
  std::mt19937 random(1);
  for (int i = 0; i < 40; ++i) {
    if (i % 10 == 9) T.pretranslate(Eigen::Vector3d(0.013, 0.02, 0));
    const std::vector<SurfacePatch> surfaces = {
        {"floor", {}, {{-1, -1}, {0.1 * (i / 20), 1}, {-1, 1}}}};
    for (int k = 0; k < 5; ++k) {
      const std::size_t at = random() % (drawn.rgb.size() - 60);
      std::fill_n(&drawn.rgb[at], 60, static_cast<std::uint8_t>(random() % 3 * 127));
    }
    const Rigid<Projector, World> pose(T);
    Image image = drawn, first = drawn;
    output.apply(image, surfaces, pose);
    LightOutput other = outputOf(texture);
    other.apply(first, surfaces, pose);
    ASSERT_EQ(image.rgb, first.rgb) << i;
    const TextureReport now = output.textureReports().at(0), once = other.textureReports().at(0);
    EXPECT_EQ(now.lit, once.lit) << i;
    EXPECT_EQ(now.clipped, once.clipped) << i;
    EXPECT_EQ(now.unknown, once.unknown) << i;
  }
}

TEST(TextureLight, refusesAnImageOfAnotherSize) {
  LightOutput output = outputOf(halves());
  Image image{10, 10, std::vector<std::uint8_t>(300)};
  EXPECT_THROW(output.apply(image, {{"floor", {}, {}}}, kPose), std::logic_error);
}

TEST(TextureFile, readsBackWhatWasWrittenAndNamesWhatIsWrong) {
  const test::TempFolder folder;
  calib::SurfaceTexture texture = halves();
  texture.color.M_seen_light = 0.6 * Eigen::Matrix3d::Identity();
  texture.cells[5] = {};
  texture.cells[7].dark = {0.01f, 0.02f, 0.03f};
  const std::string path = calib::saveTexture(folder.path(""), texture);
  EXPECT_EQ(path, folder.path("floor_texture.yaml"));
  const calib::SurfaceTexture read = calib::loadTexture(path);
  EXPECT_EQ(read.surface, "floor");
  EXPECT_EQ(read.origin, texture.origin);
  EXPECT_EQ(read.cell, texture.cell);
  EXPECT_EQ(read.density, texture.density);
  EXPECT_EQ(read.color.levels, texture.color.levels);
  ASSERT_EQ(read.cells.size(), texture.cells.size());
  EXPECT_FALSE(read.cells[5].isKnown());
  for (const std::size_t i : {0u, 7u, 6399u}) {
    EXPECT_LT((read.cells[i].M_seen_light - texture.cells[i].M_seen_light).norm(), 1e-4);
    EXPECT_LT((read.cells[i].dark - texture.cells[i].dark).norm(), 1e-4);
  }
  std::ifstream file(path);
  const std::string whole(std::istreambuf_iterator<char>(file), {});
  const auto refusedFor = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    test::writeFile(path, text.replace(text.find(from), from.size(), to));
    try {
      calib::loadTexture(path);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusedFor("floor_texture.png", "../floor.png"),
            path + ":12: 'picture' names a file of the same folder");
  EXPECT_EQ(refusedFor("cell: 0.01", "cell: .nan"), path + ":8: 'cell' should be a finite number");
  EXPECT_EQ(refusedFor("cell: 0.01", "cell: 0"), path + ":8: 'cell' goes from 0.0001 to 1");
  EXPECT_EQ(refusedFor("columns: 80", "columns: 2000000000"),
            path + ":9: 'columns' times 'rows' goes from 1 to 4000000");
  EXPECT_EQ(refusedFor("columns: 80", "columns: 20000"),
            path + ":9: 'columns' and 'rows' go up to 16384");
  EXPECT_EQ(refusedFor("rows: 80", "rows: 81"),
            folder.path("floor_texture.png") +
                ": should have 80 x 324 pixels of three channels and 16 bits, as " + path +
                " says");
  EXPECT_EQ(refusedFor("\ndensity", "\ndestiny").find(path + ":11: unknown key 'destiny'"), 0u);
  texture.surface = "../floor";
  EXPECT_THROW(calib::saveTexture(folder.path(""), texture), std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::render::texture_light_test
