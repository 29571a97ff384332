#include "calib/color/color.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "calib/color/color_photographs.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::color_test {
namespace {

/// A projector with curves of its own, whose primaries leak into each other, on wood, in a lit
/// room; and a camera with noise. Light by wavelength: nine bands, 400 to 720 nm.
class Room {
 public:
  using Bands = std::array<double, 9>;

  double gamma[3] = {2.0, 2.3, 2.5};
  double knee = 0.15;  ///< how S-shaped the curves are
  double added_white = 0;
  double room_light = 0.03;
  double noise = 0.0005;
  double exposure = 0.35;
  Bands wood = {0.18, 0.20, 0.24, 0.33, 0.44, 0.54, 0.60, 0.63, 0.65};

  explicit Room(unsigned seed) : random_(seed) {}

  /// What a camera without noise has as RGB.
  Eigen::Vector3d look(const Rgb& sent) const {
    double light[3];
    for (int i = 0; i < 3; ++i) {
      const double level = sent[static_cast<std::size_t>(i)] / 255.0;
      const double curved = std::pow(level, gamma[i]);
      light[i] = 0.002 + 0.998 * ((1 - knee) * curved + knee * curved * curved * (3 - 2 * curved));
    }
    const double white = added_white * std::min({light[0], light[1], light[2]});
    const Bands red = {.01, .01, .01, .02, .03, .20, .95, .9, .3},
                green = {.01, .02, .10, .60, .95, .40, .05, .02, .01},
                blue = {.70, .95, .40, .08, .02, .01, .01, .01, .01},
                sees_red = {.05, .02, .01, .02, .10, .55, .95, .6, .2},
                sees_green = {.02, .06, .15, .55, .95, .55, .12, .05, .02},
                sees_blue = {.60, .95, .60, .20, .05, .02, .01, .01, .0};
    Eigen::Vector3d seen = Eigen::Vector3d::Zero();
    for (std::size_t band = 0; band < 9; ++band) {
      const double on = light[0] * red[band] + light[1] * green[band] + light[2] * blue[band] +
                        white + room_light * (0.6 + 0.08 * static_cast<double>(band));
      seen += on * wood[band] *
              Eigen::Vector3d(1.1 * sees_red[band], sees_green[band], 1.4 * sees_blue[band]);
    }
    return exposure * seen;
  }

  Eigen::Vector3d photograph(const Rgb& sent) {
    const auto some = [&] { return noise * normal_(random_); };
    return look(sent) + Eigen::Vector3d(some(), some(), some());
  }

  std::vector<ColorSample> samples() {
    std::vector<ColorSample> all;
    for (const Rgb& shown : colorsToShow()) all.push_back({shown, photograph(shown)});
    return all;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

Eigen::Vector3d lightOf(const Rgb& color) {
  return {lightOfSrgb(color[0] / 255.0), lightOfSrgb(color[1] / 255.0),
          lightOfSrgb(color[2] / 255.0)};
}

double share(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

std::string refusal(const std::vector<ColorSample>& samples) {
  try {
    fitColor(samples);
  } catch (const ColorRefused& refused) {
    return refused.what();
  }
  return "accepted";
}

std::vector<Rgb> someColors(int count) {
  std::mt19937 random(5);
  std::vector<Rgb> colors;
  for (int i = 0; i < count; ++i) {
    Rgb color;
    for (std::uint8_t& value : color) value = static_cast<std::uint8_t>(random() % 256);
    colors.push_back(color);
  }
  return colors;
}

TEST(Color, whatIsAskedForIsSeenOnWood) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Room room(seed);
    const ColorFit fit = fitColor(room.samples());
    const double white = fit.response.white(), plain_white = room.look({255, 255, 255}).maxCoeff();
    std::vector<double> before, after;
    for (const Rgb& wanted : someColors(2000)) {
      const SentColor sent = colorToSend(fit.response, wanted);
      if (sent.off > kReachedDifference) continue;
      const Eigen::Vector3d lab = labOf(lightOf(wanted));
      after.push_back(colorDifference(labOf(room.look(sent.sent) / white), lab));
      before.push_back(colorDifference(labOf(room.look(wanted) / plain_white), lab));
    }
    EXPECT_GT(after.size(), 200u);
    EXPECT_GT(share(before, 0.5), 15);
    EXPECT_LT(share(after, 0.5), 1);
    EXPECT_LT(share(after, 0.95), 2.5);
  }
}

TEST(Color, saysWhichColorsCannotBeReachedAndByHowMuch) {
  Room room(1);
  const ColorFit fit = fitColor(room.samples());
  EXPECT_NEAR(fit.share_reached, 0.17, 0.1);
  for (const ColorReach& reach : fit.named) {
    const Rgb wanted = reach.name == "white"  ? Rgb{255, 255, 255}
                       : reach.name == "blue" ? Rgb{0, 0, 255}
                       : reach.name == "gray" ? Rgb{128, 128, 128}
                                              : Rgb{};
    if (wanted == Rgb{}) continue;
    const double is = colorDifference(
        labOf(room.look(reach.color.sent) / fit.response.white()), labOf(lightOf(wanted)));
    EXPECT_NEAR(reach.color.off, is, 2) << reach.name;
    EXPECT_EQ(reach.color.off > 10, reach.name == "blue") << reach.name;
  }
}

TEST(Color, onWhitePaperInTheDarkMoreIsReached) {
  Room room(2);
  const double on_wood = fitColor(room.samples()).share_reached;
  room.wood.fill(0.7);
  room.room_light = 0.0005;
  room.exposure = 0.25;
  EXPECT_GT(fitColor(room.samples()).share_reached, 1.4 * on_wood);
}

TEST(Color, aProjectorThatIsSrgbIsSentWhatIsWanted) {
  std::vector<ColorSample> samples;
  for (const Rgb& shown : colorsToShow()) samples.push_back({shown, 0.8 * lightOf(shown)});
  const ColorFit fit = fitColor(samples);
  EXPECT_EQ(fit.share_reached, 1);
  EXPECT_LT(fit.check_worst, 0.1);
  for (const Rgb& wanted : someColors(100)) {
    const Rgb sent = colorToSend(fit.response, wanted).sent;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(sent[i], wanted[i], 1);
  }
}

TEST(Color, blackIsNoLightAndLessBrightnessIsDarker) {
  Room room(3);
  const ColorFit fit = fitColor(room.samples());
  EXPECT_EQ(colorToSend(fit.response, {0, 0, 0}).sent, (Rgb{0, 0, 0}));
  const double white = fit.response.white();
  const Rgb half = colorToSend(fit.response, {255, 255, 255}, 0.5).sent;
  EXPECT_NEAR(room.look(half).y() / white, 0.5, 0.03);
}

TEST(Color, theTableHasWhatIsSentForItsColors) {
  Room room(4);
  const ColorFit fit = fitColor(room.samples());
  const auto table = colorTable(fit.response, 0.8);
  ASSERT_EQ(table.size(), 3u * 33 * 33 * 33);
  const auto at = [&](std::size_t r, std::size_t g, std::size_t b) {
    const std::size_t i = 3 * (r + 33 * (g + 33 * b));
    return Rgb{table[i], table[i + 1], table[i + 2]};
  };
  EXPECT_EQ(at(0, 0, 0), (Rgb{0, 0, 0}));
  EXPECT_EQ(at(32, 16, 0), colorToSend(fit.response, {255, 128, 0}, 0.8).sent);
  EXPECT_EQ(at(8, 0, 32), colorToSend(fit.response, {64, 0, 255}, 0.8).sent);
}

TEST(Color, isCheckedByMixturesAloneAndTellsWhereThereAreNone) {
  Room room(5);
  auto samples = room.samples();
  EXPECT_EQ(fitColor(samples).checks, 8);
  samples.erase(std::remove_if(samples.begin(), samples.end(),
                               [](const ColorSample& sample) { return isCheck(sample.shown); }),
                samples.end());
  const ColorFit fit = fitColor(samples);
  EXPECT_EQ(fit.checks, 0);
  EXPECT_TRUE(std::isnan(fit.check_median) && std::isnan(fit.check_worst));
  EXPECT_EQ(checksText(fit.checks, fit.check_median, "the worst", fit.check_worst),
            "No mixed color was photographed: nothing says how right this is.");
}

TEST(Color, refusesWhatCannotBeMeasuredWith) {
  Room room(1);
  const auto good = room.samples();
  EXPECT_EQ(refusal(good), "accepted");
  auto samples = good;
  samples.back().seen *= 1.1;
  EXPECT_EQ(refusal(samples).find("two photographs of #ffffff differ: fix the camera's"), 0u)
      << refusal(samples);
  samples = good;
  samples[1].seen.x() = 0.97;
  EXPECT_EQ(refusal(samples), "the photograph of #ffffff is overexposed: expose all shorter");
  samples = good;
  for (ColorSample& sample : samples) sample.seen *= 0.01;
  EXPECT_EQ(refusal(samples).find("the photographs are too dark"), 0u);
  samples = good;
  samples[3].seen.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(samples), "a color that was seen is no number");
  EXPECT_EQ(refusal({good[1], good[2]}), "no photograph of black (#000000)");
  samples.assign(good.begin() + 2, good.end() - 1);
  EXPECT_EQ(refusal(samples), "no photograph of white (#ffffff)");
  EXPECT_EQ(refusal({good[0], good[1]}), "no photograph of #ff0000");
  Room brilliant(1);
  brilliant.added_white = 1.5;
  brilliant.exposure = 0.15;
  EXPECT_EQ(refusal(brilliant.samples()).find("white is 183 % brighter than red"), 0u)
      << refusal(brilliant.samples());
  Room dull(1);
  dull.wood.fill(0);
  dull.wood[6] = 1;  // lets one band through
  EXPECT_NE(refusal(dull.samples()), "accepted");
}

TEST(ColorFile, readsBackWhatWasWrittenAndNamesWhatIsWrong) {
  Room room(6);
  const ColorFit fit = fitColor(room.samples());
  const test::TempFolder folder;
  const std::string path = folder.path("color.yaml"), whole = colorYaml(fit);
  test::writeFile(path, whole);
  const ColorResponse read = loadColor(path);
  EXPECT_EQ(read.levels, fit.response.levels);
  EXPECT_EQ(read.response, fit.response.response);
  EXPECT_EQ(read.M_seen_light, fit.response.M_seen_light);
  EXPECT_EQ(read.dark, fit.response.dark);
  const auto refusedFor = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    test::writeFile(path, text.replace(text.find(from), from.size(), to));
    try {
      loadColor(path);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(path.size());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusedFor("levels: [0, 32", "levels: [0, 0"),
            ":3: 'levels' should ascend from 0 to 255");
  EXPECT_EQ(refusedFor("red: [0", "red: [0.5"), ":4: 'red' should ascend from 0 to 1");
  EXPECT_EQ(refusedFor("dark: [", "dark: [1, "), ":11: 'dark' should be 3 numbers in brackets");
  EXPECT_EQ(refusedFor("blue", "bleu").substr(0, 21), ":6: unknown key 'bleu");
}

TEST(ColorPhotographs, areReadWhereTheProjectorLights) {
  const test::TempFolder folder;
  const std::string pictures = folder.path("pictures"), photographs = folder.path("photographs");
  EXPECT_EQ(writeColorPictures(pictures, 64, 40), colorsToShow().size());
  EXPECT_EQ(cv::imread(pictures + "/04_600000.png").at<cv::Vec3b>(39, 63), cv::Vec3b(0, 0, 0x60));
  std::filesystem::create_directory(photographs);
  Room room(7);
  const Eigen::Vector3d dark = room.look({0, 0, 0});
  for (const auto& entry : std::filesystem::directory_iterator(pictures)) {
    const std::string stem = entry.path().stem().string();
    const cv::Vec3b shown = cv::imread(entry.path().string()).at<cv::Vec3b>(0, 0);
    const Eigen::Vector3d lit = room.look({shown[2], shown[1], shown[0]});
    cv::Mat photograph(120, 160, CV_8UC3);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        const Eigen::Vector3d& light = x > 50 && y > 30 && x < 140 && y < 90 ? lit : dark;
        for (int i = 0; i < 3; ++i) {
          photograph.at<cv::Vec3b>(y, x)[i] =
              cv::saturate_cast<std::uint8_t>(255 * srgbOfLight(light[2 - i]));
        }
      }
    }
    cv::imwrite(photographs + "/" + stem + ".png", photograph);
  }
  test::writeFile(photographs + "/notes.txt", "not a photograph");
  test::writeFile(photographs + "/scene.png", "nor this");
  const auto samples = readColorPhotographs(photographs);
  ASSERT_EQ(samples.size(), colorsToShow().size());
  for (const ColorSample& sample : samples) {
    EXPECT_LT((sample.seen - room.look(sample.shown)).norm(), 0.006) << int(sample.shown[0]);
  }
  EXPECT_LT(fitColor(samples).check_median, 2);
  const auto refusal = [&](const std::string& of) {
    try {
      readColorPhotographs(of);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(of.size());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusal(folder.path("nowhere")), ": cannot be read");
  test::writeFile(photographs + "/04_600000.png", "broken");
  EXPECT_EQ(refusal(photographs), "/04_600000.png: cannot be read as a picture");
  cv::imwrite(photographs + "/04_600000.png", cv::Mat(60, 60, CV_8UC3, cv::Scalar(1, 2, 3)));
  EXPECT_EQ(refusal(photographs),
            "/04_600000.png: is of another size than the photograph of black");
  cv::imwrite(photographs + "/04_600000.png", cv::Mat(120, 160, CV_8UC3, cv::Scalar(1, 2, 255)));
  EXPECT_EQ(refusal(photographs), "/04_600000.png: overexposed (100 % of what is lit): expose all "
                                  "photographs shorter");
  std::filesystem::remove(photographs + "/00_000000.png");
  std::filesystem::remove(photographs + "/34_000000.png");
  EXPECT_EQ(refusal(photographs).find(": holds no photograph of black"), 0u);
}

/// Pairs of the article's table of test data.
TEST(ColorDifference, isThatOfTheArticle) {
  const auto off = [](double L1, double a1, double b1, double L2, double a2, double b2) {
    return colorDifference({L1, a1, b1}, {L2, a2, b2});
  };
  EXPECT_NEAR(off(50, 2.6772, -79.7751, 50, 0, -82.7485), 2.0425, 5e-5);
  EXPECT_NEAR(off(50, -1.3802, -84.2814, 50, 0, -82.7485), 1.0000, 5e-5);
  EXPECT_NEAR(off(50, 2.4900, -0.0010, 50, -2.4900, 0.0009), 7.1792, 5e-5);
  EXPECT_NEAR(off(50, 2.5, 0, 73, 25, -18), 27.1492, 5e-5);
  EXPECT_NEAR(off(2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514), 0.9082, 5e-5);
  EXPECT_NEAR(off(60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387), 1.2644, 5e-5);
  EXPECT_NEAR(labOf({1, 1, 1}).x(), 100, 1e-9);
  EXPECT_LT(labOf({0.2, 0.2, 0.2}).tail<2>().norm(), 1e-9);
}

}  // namespace
}  // namespace afterglow::calib::color_test
