#include "nodes/tools/video_writer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::video_writer_test {
namespace {

render::Image gray(int width, int height, std::uint8_t level) {
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  return {width, height, std::vector<std::uint8_t>(count, level)};
}

std::string outputOf(const std::string& command) {
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::array<char, 256> buffer;
  std::string text;
  while (fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) text += buffer.data();
  return text;
}

bool hasFfmpeg() { return std::system("command -v ffmpeg ffprobe >/dev/null") == 0; }

TEST(VideoWriter, writesEveryFrameAndRenamesWhenDone) {
  if (!hasFfmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const test::TempFolder folder;
  const std::string path = folder.path("film.mp4");
  VideoWriter writer(path, 65, 34, 10);  // odd: padded, as H.264 wants it
  for (int i = 0; i < 7; ++i) writer.write(gray(65, 34, static_cast<std::uint8_t>(i * 30)));
  EXPECT_FALSE(std::filesystem::exists(path));
  writer.close();
  EXPECT_EQ(outputOf("ffprobe -v error -count_frames -show_entries "
                     "stream=width,height,nb_read_frames,pix_fmt -of csv=p=0 '" +
                     path + "'"),
            "66,34,yuv420p,7\n");
  EXPECT_FALSE(std::filesystem::exists(folder.path("film.part.mp4")));
}

TEST(VideoWriter, leavesNothingBehindWithoutClose) {
  if (!hasFfmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const test::TempFolder folder;
  { VideoWriter(folder.path("film.mp4"), 64, 64, 10).write(gray(64, 64, 9)); }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path("")));
}

TEST(VideoWriter, saysWhatFfmpegSays) {
  if (!hasFfmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const test::TempFolder folder;
  try {
    VideoWriter writer(folder.path("nowhere/film.mp4"), 64, 64, 10);
    for (int i = 0; i < 100; ++i) writer.write(gray(64, 64, 9));
    writer.close();
    FAIL() << "a video in a folder that is not there";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("No such file or directory"), std::string::npos)
        << error.what();
  }
}

TEST(VideoWriter, keepsTheOldFileWhenItFails) {
  if (!hasFfmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const test::TempFolder folder;
  const std::string path = folder.path("film.mp4");
  std::ofstream(path) << "old";
  VideoWriter writer(path, 64, 64, 10);
  EXPECT_THROW(writer.write(gray(32, 64, 9)), std::invalid_argument);
  EXPECT_THROW(writer.close(), std::runtime_error);  // no frame
  EXPECT_EQ(outputOf("cat '" + path + "'"), "old");
}

}  // namespace
}  // namespace afterglow::nodes::video_writer_test
