#include "nodes/observer/caption.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "tests/support/image_measures.hpp"

namespace afterglow::nodes::caption_test {
namespace {

constexpr int kWidth = 640, kHeight = 360;

render::Image gray(int width, int height, std::uint8_t level) {
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  return {width, height, std::vector<std::uint8_t>(count, level)};
}

int brightest(const render::Image& image, int left, int top, int right, int bottom) {
  int most = 0;
  for (int v = top; v < bottom; ++v) {
    for (int u = left; u < right; ++u) most = std::max(most, test::brightness(image, u, v));
  }
  return most;
}

/// How wide the white letters are.
int widthOfText(const Caption& caption) {
  const render::Image picture = CaptionPainter().withStrip(gray(kWidth, kHeight, 60), caption);
  int left = kWidth, right = 0;
  for (int v = kHeight; v < picture.height; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (test::brightness(picture, u, v) < 500) continue;
      left = std::min(left, u);
      right = std::max(right, u);
    }
  }
  return right - left;
}

TEST(Caption, isInAStripBelowThePictureWhichStaysAsItIs) {
  const render::Image picture = gray(kWidth, kHeight, 200);
  const render::Image whole =
      CaptionPainter().withStrip(picture, {"replay", "The robot looks.", "Ok.", ""});
  EXPECT_EQ(whole.width, kWidth);
  EXPECT_EQ(whole.height, kHeight + stripHeight(kWidth));
  ASSERT_EQ(whole.rgb.size(), static_cast<std::size_t>(whole.width * whole.height * 3));
  EXPECT_TRUE(std::equal(picture.rgb.begin(), picture.rgb.end(), whole.rgb.begin()));
  EXPECT_LT(test::brightness(whole, kWidth - 2, kHeight), 100);
  EXPECT_GT(brightest(whole, 0, kHeight, kWidth, whole.height), 700);
}

TEST(Caption, hasTheSameStripWhateverIsSaid) {
  CaptionPainter painter;
  const render::Image none = painter.withStrip(gray(kWidth, kHeight, 200), {});
  EXPECT_EQ(none.height, kHeight + stripHeight(kWidth));
  EXPECT_LT(brightest(none, 0, kHeight, kWidth, none.height), 100);
  const int first_line = kHeight + stripHeight(kWidth) / 2;
  const render::Image said = painter.withStrip(gray(kWidth, kHeight, 200), {"", "", "Ok.", ""});
  EXPECT_GT(brightest(said, 0, first_line, kWidth, said.height), 400);
  EXPECT_EQ(stripHeight(1280), 72);
  EXPECT_EQ(stripHeight(1281) % 2, 0) << "as yuv420p wants it";
}

TEST(Caption, showsWhatAHumanAskedInPlaceOfTheText) {
  EXPECT_GT(widthOfText({"", "", "", "What did you pick up, and where?"}), 100);
  CaptionPainter painter;
  const render::Image picture = gray(kWidth, kHeight, 60);
  EXPECT_EQ(painter.withStrip(picture, {"", "what it is about", "", "Why?"}).rgb,
            painter.withStrip(picture, {"", "", "", "Why?"}).rgb);
}

TEST(Caption, saysWhatGraySolidsAreBesideWhatIsSaid) {
  CaptionPainter painter;
  Caption caption{"", "", std::string(120, 'o'), ""};
  const auto rightHalf = [&] {
    const render::Image whole = painter.withStrip(gray(1280, 648, 60), caption);
    std::vector<int> levels;
    for (int u = 960; u < 1280; ++u) levels.push_back(brightest(whole, u, 684, u + 1, 720));
    return levels;
  };
  const std::vector<int> said = rightHalf();
  caption.has_ghosts = true;
  const std::vector<int> both = rightHalf();
  EXPECT_NE(said, both);
  caption.speech.clear();
  EXPECT_EQ(rightHalf(), both) << "long words end before it";
}

TEST(Caption, makesLongTextFitThePicture) {
  const std::string words = "The robot picks up what it takes for a gearbox bottom. ";
  EXPECT_LT(widthOfText({"", words + words, ""}), kWidth - 30) << "it ends before the edge";
  EXPECT_GT(widthOfText({"", words + words, ""}), kWidth * 8 / 10);
}

TEST(Caption, showsLettersBeyondAscii) {
  EXPECT_GT(widthOfText({"", "“é”", ""}), 10);
  EXPECT_NO_THROW(widthOfText({"", "caf\xe9 \xff\xfe broken\nlines\ttoo", ""}));
}

TEST(Caption, labelsAPictureInItsCorner) {
  render::Image picture = gray(kWidth, kHeight, 60);
  CaptionPainter().paintLabel(picture, "NOW");
  EXPECT_GT(brightest(picture, 0, 0, kWidth / 4, kHeight / 8), 700);
  EXPECT_EQ(brightest(picture, kWidth / 4, 0, kWidth, kHeight), 180);
  EXPECT_EQ(brightest(picture, 0, kHeight / 8, kWidth, kHeight), 180);
}

TEST(Caption, framesAnInsetInTheCorner) {
  render::Image picture = gray(kWidth, kHeight, 60);
  const render::Image inset = gray(128, 80, 250);
  CaptionPainter().paintInset(picture, inset, "projector image");
  EXPECT_GT(test::brightness(picture, kWidth - 50, 30), 740);
  EXPECT_EQ(test::brightness(picture, kWidth / 2, 40), 180);
  EXPECT_EQ(test::brightness(picture, kWidth - 80, kHeight / 2), 180);
}

TEST(Caption, findsTheLitPartWithTheProportionsOfTheImage) {
  render::Image image = gray(1280, 800, 0);
  EXPECT_FALSE(litPart(image));
  for (int u = 700; u < 760; ++u) image.rgb[3 * (1280 * 350 + u)] = 200;
  const auto part = litPart(image);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->width, 320);
  EXPECT_EQ(part->height, 200);
  EXPECT_LE(part->left, 700);
  EXPECT_GE(part->left + part->width, 760);
  EXPECT_LE(part->top, 350);
  EXPECT_GE(part->top + part->height, 351);
  const auto all = litPart(gray(1280, 800, 90));
  ASSERT_TRUE(all);
  EXPECT_EQ(all->width, 1280);
  EXPECT_EQ(all->height, 800);
}

TEST(Caption, hasNoInsetWithoutLight) {
  render::Image picture = gray(kWidth, kHeight, 60);
  CaptionPainter().paintInset(picture, gray(128, 80, 0), "projector image");
  EXPECT_EQ(picture.rgb, gray(kWidth, kHeight, 60).rgb);
}

TEST(Caption, leavesPicturesAloneThatAreTooSmallForAnInset) {
  render::Image picture = gray(40, 20, 60);
  CaptionPainter().paintInset(picture, gray(128, 80, 250), "projector image");
  EXPECT_EQ(picture.rgb, gray(40, 20, 60).rgb);
}

TEST(Caption, namesTheFontItCannotRead) {
  try {
    CaptionPainter painter("/no/font.ttf");
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/no/font.ttf: cannot read the font (package fonts-dejavu-core)");
  }
}

}  // namespace
}  // namespace afterglow::nodes::caption_test
