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

/// The first row that differs from a picture of this level.
int firstChangedRow(const render::Image& image, int level) {
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if (test::brightness(image, u, v) != 3 * level) return v;
    }
  }
  return image.height;
}

/// How wide the white letters are.
int widthOfText(const Caption& caption) {
  render::Image picture = gray(kWidth, kHeight, 60);
  CaptionPainter().paint(picture, caption);
  int left = kWidth, right = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (test::brightness(picture, u, v) < 500) continue;
      left = std::min(left, u);
      right = std::max(right, u);
    }
  }
  return right - left;
}

TEST(Caption, comesWithOrWithoutATag) {
  const Caption plain = parseCaption("The robot looks.");
  EXPECT_EQ(plain.tag, "");
  EXPECT_EQ(plain.text, "The robot looks.");
  const Caption tagged = parseCaption("replay|What did you do? | Tell me.");
  EXPECT_EQ(tagged.tag, "replay");
  EXPECT_EQ(tagged.text, "What did you do? | Tell me.");
}

TEST(Caption, isWhiteOnADarkBarAtTheBottom) {
  render::Image picture = gray(kWidth, kHeight, 200);
  CaptionPainter().paint(picture, {"", "The robot looks.", ""});
  const int bar = firstChangedRow(picture, 200);
  EXPECT_GT(bar, kHeight * 85 / 100);
  EXPECT_LT(test::brightness(picture, kWidth - 2, bar + 5), 300) << "a dark bar, ...";
  EXPECT_GT(test::brightness(picture, kWidth - 2, bar + 5), 100) << "... but translucent";
  EXPECT_GT(brightest(picture, 0, bar, kWidth / 2, kHeight), 740);
}

TEST(Caption, isTallerWithSpeech) {
  render::Image text = gray(kWidth, kHeight, 200), both = text, speech = text, none = text;
  CaptionPainter painter;
  painter.paint(text, {"", "The robot looks.", ""});
  painter.paint(both, {"", "The robot looks.", "Ok."});
  painter.paint(speech, {"", "", "Ok."});
  painter.paint(none, {"", "", ""});
  EXPECT_LT(firstChangedRow(both, 200), firstChangedRow(text, 200));
  EXPECT_EQ(firstChangedRow(speech, 200), firstChangedRow(text, 200));
  EXPECT_EQ(firstChangedRow(none, 200), kHeight) << "nothing is painted";
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

TEST(Caption, framesAnInsetInTheCorner) {
  render::Image picture = gray(kWidth, kHeight, 60);
  const render::Image inset = gray(128, 80, 250);
  CaptionPainter().paintInset(picture, inset, "projector image");
  EXPECT_GT(test::brightness(picture, kWidth - 80, 40), 740);
  EXPECT_EQ(test::brightness(picture, kWidth / 2, 40), 180);
  EXPECT_EQ(test::brightness(picture, kWidth - 80, kHeight / 2), 180);
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
