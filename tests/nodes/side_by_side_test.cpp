#include "nodes/tools/side_by_side.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "nodes/tools/program.hpp"
#include "nodes/tools/video_writer.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::side_by_side_test {
namespace {

double lengthOf(const std::vector<FilmSpan>& spans) {
  double sum = 0;
  for (const FilmSpan& span : spans) sum += span.end_s - span.begin_s;
  return sum;
}

TEST(KeptSpans, cutTheQuietSeconds) {
  const auto spans = keptSpans({{3, 103}, {20, 120}}, {}, {100, 130}, 60);
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_LE(spans[0].begin_s, 102);
  EXPECT_GE(spans[0].end_s, 104);
  EXPECT_LT(spans[0].end_s, 108);
  EXPECT_GT(spans[1].begin_s, 115);
}

TEST(KeptSpans, fitByShowingLessAroundTheMoments) {
  const std::vector<FilmMoment> moments = {{0, 100}, {10, 110}, {20, 120}, {30, 130}};
  EXPECT_LE(lengthOf(keptSpans(moments, {}, {90, 140}, 8)), 8);
  EXPECT_GT(lengthOf(keptSpans(moments, {}, {90, 140}, 8)), 6);
}

TEST(KeptSpans, keepAllThatIsSaid) {
  const auto spans = keptSpans({{5, 105}}, {{110, 118}}, {100, 130}, 2);
  EXPECT_LE(spans.back().begin_s, 110);
  EXPECT_GE(spans.back().end_s, 118);
}

TEST(KeptSpans, stayWithinTheWholeAndApart) {
  const auto spans = keptSpans({{0, 100}, {2, 102}, {30, 130}}, {{101, 104}}, {100, 130}, 60);
  EXPECT_EQ(spans.front().begin_s, 100);
  EXPECT_EQ(spans.back().end_s, 130);
  for (std::size_t i = 1; i < spans.size(); ++i) {
    EXPECT_GT(spans[i].begin_s, spans[i - 1].end_s);
  }
  EXPECT_TRUE(keptSpans({}, {}, {0, 10}, 5).empty());
}

TEST(SideBySide, showsThenAsFarFromTheNearestMomentAsNow) {
  const std::vector<FilmMoment> moments = {{10, 60}, {20, 75}};
  EXPECT_DOUBLE_EQ(thenAt(moments, 61), 11);
  EXPECT_DOUBLE_EQ(thenAt(moments, 74), 19);
  EXPECT_DOUBLE_EQ(thenAt({}, 7), 7);
}

/// Four seconds of one brightness; the strip below is bright.
void film(const std::string& path, std::uint8_t level) {
  VideoWriter video(path, 640, 360, 25);
  render::Image image{640, 360, std::vector<std::uint8_t>(640 * 360 * 3, level)};
  std::fill(image.rgb.begin() + 640 * 304 * 3, image.rgb.end(), std::uint8_t{230});
  for (int i = 0; i < 100; ++i) video.write(image);
  video.close();
}

SideBySide twoFilms(const std::string& then, const std::string& now) {
  SideBySide films;
  films.then = then;
  films.now = now;
  films.width = 640;
  films.height = 360;
  films.strip = 56;
  films.lead = {0.4, 1.0};
  films.spans = {{1.0, 1.6}, {3.0, 3.6}};
  films.moments = {{1, 1}};
  return films;
}

TEST(SideBySide, putsThenOnTheLeftNowOnTheRightAndTheStripBelow) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  test::TempFolder folder;
  const std::string path = folder.path("both.mp4");
  film(folder.path("then.mp4"), 60);
  film(folder.path("now.mp4"), 150);
  SideBySide films = twoFilms(folder.path("then.mp4"), folder.path("now.mp4"));
  films.then_label = "it's 7:30, [100 %] C:\\";  // no filter's punctuation
  makeSideBySide(films, path);
  EXPECT_EQ(runProgram({"ffprobe", "-v", "error", "-count_frames", "-show_entries",
                        "stream=width,height,nb_read_frames", "-of", "csv=p=0", path})
                .output,
            "640,284,45\n");
  // Columns 0 and 3 of 4: beside the labels.
  const std::string gray = runProgram({"ffmpeg", "-v", "error", "-i", path, "-frames:v", "1", "-vf",
                                       "scale=4:5:flags=area", "-f", "rawvideo", "-pix_fmt",
                                       "gray", "-"})
                               .output;
  ASSERT_EQ(gray.size(), 20u);
  const auto level = [&](int row, int column) {
    return static_cast<int>(static_cast<unsigned char>(gray[4 * row + column]));
  };
  EXPECT_NEAR(level(2, 1), 60, 12);
  EXPECT_NEAR(level(2, 3), 150, 12);
  EXPECT_NEAR(level(4, 1), 230, 12);
}

/// Two seconds of each brightness.
void changingFilm(const std::string& path, const std::vector<std::uint8_t>& levels) {
  VideoWriter video(path, 640, 360, 25);
  for (const std::uint8_t level : levels) {
    const render::Image image{640, 360, std::vector<std::uint8_t>(640 * 360 * 3, level)};
    for (int i = 0; i < 50; ++i) video.write(image);
  }
  video.close();
}

TEST(SideBySide, showsThenFromItsOwnFirstImageOn) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  test::TempFolder folder;
  const std::string film = folder.path("film.mp4"), path = folder.path("both.mp4");
  changingFilm(film, {60, 120, 180, 230});  // another behavior, then, another one, now
  SideBySide films;
  films.then = films.now = film;
  films.width = 640;
  films.height = 360;
  films.strip = 56;
  films.then_begin_s = 2;
  films.lead = {6, 6.6};
  films.spans = {{6.6, 7.4}};
  films.moments = {{2.2, 7.2}};  // now's first seconds are from before then began
  makeSideBySide(films, path);
  const std::string gray = runProgram({"ffmpeg", "-v", "error", "-i", path, "-vf",
                                       "crop=200:100:60:60,scale=1:1:flags=area", "-f", "rawvideo",
                                       "-pix_fmt", "gray", "-"})
                               .output;
  EXPECT_EQ(gray.size(), 35u) << "images";
  for (const char level : gray) EXPECT_NEAR(static_cast<unsigned char>(level), 120, 12);
}

TEST(SideBySide, saysWhatItCannotRead) {
  if (!hasProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
  test::TempFolder folder;
  try {
    makeSideBySide(twoFilms(folder.path("none.mp4"), folder.path("none.mp4")),
                   folder.path("both.mp4"));
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("none.mp4"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path("both.part.mp4")));
}

}  // namespace
}  // namespace afterglow::nodes::side_by_side_test
