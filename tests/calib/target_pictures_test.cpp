// Pictures of boards and patterns and the page to print, against the layouts they belong to.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>

#include "calib/detection/tag_detector.hpp"
#include "calib/targets/tag.hpp"
#include "calib/targets/target_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::target_pictures_test {
namespace {

using test::TempFolder;

const Eigen::Vector2d kA4(0.297, 0.210), kA2(0.594, 0.420), kOdd(0.2, 0.333);

/// What a command prints; nothing if it is not there.
std::string outputOf(const std::string& command) {
  std::string output;
  FILE* pipe = popen((command + " 2>/dev/null").c_str(), "r");
  std::array<char, 4096> bytes{};
  for (std::size_t count; (count = fread(bytes.data(), 1, bytes.size(), pipe)) > 0;) {
    output.append(bytes.data(), count);
  }
  pclose(pipe);
  return output;
}

/// A picture of a sheet, edge to edge.
struct SheetPicture {
  Picture picture;
  Eigen::Vector2d size_m, pixels_per_m;

  Eigen::Vector2d pixelOf(const Eigen::Vector2d& p_board) const {
    return {(p_board.x() + size_m.x() / 2) * pixels_per_m.x() - 0.5,
            (size_m.y() / 2 - p_board.y()) * pixels_per_m.y() - 0.5};
  }
};

/// From white to black along a row or a column, within a cell either side of where it should be.
double edgeAt(const std::function<double(int)>& grayAt, double expected, double cell) {
  const int begin = static_cast<int>(std::lround(expected - cell / 2)), end = begin + int(cell);
  double white = 0;
  for (int i = begin; i < end; ++i) white += grayAt(i) / 255;
  return begin - 0.5 + (grayAt(begin) > 128 ? white : end - begin - white);
}

/// The edges of every tag's black frame, measured in its middle, against the layout.
void expectTagsWhereTheLayoutHasThem(const SheetPicture& sheet, const Board& board,
                                     double tolerance_px) {
  const Picture& picture = sheet.picture;
  for (const Tag& tag : board.tags) {
    const Eigen::Vector2d low = sheet.pixelOf(tag.corners[0]), high = sheet.pixelOf(tag.corners[2]);
    const double cell = (high.x() - low.x()) / kTagCells;
    // Through the frame beside each edge, where it is black from end to end.
    const auto row = [&](double y) {
      return [&picture, y](int x) -> double {
        return picture.at(x, static_cast<int>(std::lround(y)));
      };
    };
    const auto column = [&](double x) {
      return [&picture, x](int y) -> double {
        return picture.at(static_cast<int>(std::lround(x)), y);
      };
    };
    for (const double y : {low.y() + cell / 2, high.y() - cell / 2}) {
      EXPECT_NEAR(edgeAt(row(y), low.x(), cell), low.x(), tolerance_px) << "tag " << tag.id;
      EXPECT_NEAR(edgeAt(row(y), high.x(), cell), high.x(), tolerance_px) << "tag " << tag.id;
    }
    for (const double x : {low.x() + cell / 2, high.x() - cell / 2}) {
      EXPECT_NEAR(edgeAt(column(x), low.y(), cell), low.y(), tolerance_px) << "tag " << tag.id;
      EXPECT_NEAR(edgeAt(column(x), high.y(), cell), high.y(), tolerance_px) << "tag " << tag.id;
    }
  }
}

/// That they are those tags and upright, to a detector's accuracy.
void expectDetectorReads(const SheetPicture& sheet, const Board& board) {
  std::vector<DetectedTag> found = TagDetector(board.family).detect(sheet.picture);
  std::sort(found.begin(), found.end(), [](const Tag& a, const Tag& b) { return a.id < b.id; });
  ASSERT_EQ(found.size(), board.tags.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].id, board.tags[i].id);
    EXPECT_EQ(found[i].hamming, 0);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_LT((found[i].corners[k] - sheet.pixelOf(board.tags[i].corners[k])).norm(), 1)
          << "tag " << found[i].id;
    }
  }
}

TEST(BoardPicture, showsTheTagsWhereTheLayoutHasThem) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd, Eigen::Vector2d(3, 2)}) {
    SCOPED_TRACE(testing::Message() << size.transpose());
    const TempFolder folder;
    const Board board = makeBoard(size);
    writeBoard(folder.path("."), board);
    const Picture picture = loadPicture(folder.path("board.png"));
    EXPECT_LE(std::max(picture.width, picture.height), 4000);
    const SheetPicture sheet{picture, size,
                             Eigen::Vector2d(picture.width, picture.height).cwiseQuotient(size)};
    expectTagsWhereTheLayoutHasThem(sheet, board, 0.1);
    expectDetectorReads(sheet, board);
  }
}

TEST(BoardPicture, knowsItsPhysicalSize) {
  const TempFolder folder;
  writeBoard(folder.path("."), makeBoard(kA2));
  const std::string png = test::fileBytes(folder.path("board.png"));
  // Length 9, pHYs, 2000 (0x7d0) twice, meters, and the CRC that zlib gives for that.
  EXPECT_EQ(png.substr(33, 21), std::string("\0\0\0\x09pHYs\0\0\x07\xd0\0\0\x07\xd0\x01"
                                            "\xb9\x8b\xe7\x9f",
                                            21));
}

TEST(PatternPicture, isPureBlackAndWhiteAndReadable) {
  const TempFolder folder;
  for (const auto& [width, height] : {std::pair(1280, 800), std::pair(1920, 1080)}) {
    const Pattern pattern = makePattern(width, height);
    writePattern(folder.path("."), pattern);
    const Picture picture = loadPicture(folder.path("pattern.png"));
    ASSERT_EQ(picture.width, width);
    ASSERT_EQ(picture.height, height);
    double black = 0, expected_black = 0;
    for (const std::uint8_t gray : picture.pixels) {
      ASSERT_TRUE(gray == 0 || gray == 255) << int(gray);
      black += gray == 0 ? 1 : 0;
    }
    for (const Tag& tag : pattern.tags) {
      const double cell = (tag.corners[1].x() - tag.corners[0].x()) / kTagCells;
      const TagCells cells = tagCells(pattern.family, tag.id);
      for (std::size_t row = 0; row < kTagCells; ++row) {
        for (std::size_t column = 0; column < kTagCells; ++column) {
          if (cells[row][column]) expected_black += cell * cell;
          const Eigen::Vector2d first = tag.corners[0] + cell * Eigen::Vector2d(column, row);
          for (const double inside : {0.5, cell - 0.5}) {
            EXPECT_EQ(picture.at(int(first.x() + inside), int(first.y() + inside)),
                      cells[row][column] ? 0 : 255);
          }
        }
      }
    }
    EXPECT_EQ(black, expected_black);
    EXPECT_EQ(TagDetector(pattern.family).detect(picture).size(), pattern.tags.size());
  }
}

// ----------------------------------------------------------------------------------------- page

/// A page through poppler's eyes.
class BoardPage : public testing::Test {
 protected:
  void SetUp() override {
    if (outputOf("command -v pdftoppm && command -v pdfinfo && command -v pdftotext").empty()) {
      GTEST_SKIP() << "poppler-utils (pdfinfo, pdftoppm, pdftotext) is not installed";
    }
  }

  void write(const Board& board) {
    board_ = board;
    writeBoard(folder_.path("."), board);
  }
  /// Its text, or what it says of itself, on stdout.
  std::string poppler(const std::string& program, const std::string& end = "") const {
    return outputOf(program + " '" + folder_.path("board.pdf") + "' " + end);
  }
  SheetPicture rasterized(int dpi) const {
    poppler("pdftoppm -png -singlefile -gray -r " + std::to_string(dpi),
            "'" + folder_.path("page") + "'");
    return {loadPicture(folder_.path("page.png")), board_.size_m,
            Eigen::Vector2d::Constant(dpi / 0.0254)};
  }

  TempFolder folder_;
  Board board_;
};

/// A file's first bytes say its size, whatever follows: a PNG of 30000 x 30000 took 2.7 GB.
TEST(Pictures, ofMorePixelsThanAreReadAreRefusedByTheirHeaders) {
  using namespace std::string_literals;
  const auto big = [](std::uint32_t value, int bytes) {
    std::string text;
    for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i));
    return text;
  };
  const auto little = [&](std::uint32_t value, int bytes) {
    const std::string text = big(value, bytes);
    return std::string(text.rbegin(), text.rend());
  };
  const auto tag = [&](std::uint32_t name, std::uint32_t value) {  // a TIFF's LONG
    return little(name, 2) + little(4, 2) + little(1, 4) + little(value, 4);
  };
  const std::uint32_t side = 30000;
  const std::map<std::string, std::string> files = {
      {"a.png", "\x89PNG\r\n\x1a\n"s + big(13, 4) + "IHDR" + big(side, 4) + big(side, 4)},
      {"a.jpg", "\xff\xd8\xff\xe0\0\x04xx\xff\xc0\0\x0b\x08"s + big(side, 2) + big(side, 2)},
      {"a.bmp", "BM"s + std::string(16, '\0') + little(side, 4) +
                    little(static_cast<std::uint32_t>(-30000), 4)},  // from the top
      {"a.pgm", "P5\n# a comment\n30000 30000\n255\n"},
      {"a.tif", "II*\0"s + little(20, 4) + std::string(12, '\0') + little(2, 2) + tag(256, side) +
                    tag(257, side)}};
  const TempFolder folder;
  for (const auto& [name, bytes] : files) {
    std::ofstream(folder.path(name), std::ios::binary) << bytes << std::string(2000, '\0');
    try {
      loadPicture(folder.path(name));
      FAIL() << name;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), folder.path(name) +
                                  ": a picture of 30000 x 30000 pixels: at most 128 million are "
                                  "read");
    }
  }
}

TEST_F(BoardPage, isExactlyTheSheet) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd}) {
    write(makeBoard(size));
    double width = 0, height = 0;
    const std::string info = poppler("pdfinfo");
    const auto line = info.find("Page size:");
    ASSERT_NE(line, std::string::npos) << info;
    ASSERT_EQ(std::sscanf(info.c_str() + line, "Page size: %lf x %lf", &width, &height), 2);
    int pages = 0;
    const auto pages_line = info.find("Pages:");
    ASSERT_NE(pages_line, std::string::npos) << info;
    ASSERT_EQ(std::sscanf(info.c_str() + pages_line, "Pages: %d", &pages), 1);
    EXPECT_EQ(pages, 1);
    // A hundredth of a point is 3.5 um.
    EXPECT_NEAR(width, size.x() / 0.0254 * 72, 0.01);
    EXPECT_NEAR(height, size.y() / 0.0254 * 72, 0.01);
  }
}

TEST_F(BoardPage, showsTheTagsWhereTheLayoutHasThem) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd}) {
    SCOPED_TRACE(testing::Message() << size.transpose());
    write(makeBoard(size));
    const SheetPicture page = rasterized(150);
    // Poppler samples a pixel 4 x 4 times: an edge is known to an eighth of a pixel, 0.02 mm.
    expectTagsWhereTheLayoutHasThem(page, board_, 0.25);
    expectDetectorReads(page, board_);
  }
}

/// Pixels of the longest unbroken dark line within the free middle.
int longestLine(const Picture& picture, const Eigen::AlignedBox2d& middle) {
  int longest = 0;
  for (int y = int(middle.min().y()); y < int(middle.max().y()); ++y) {
    int length = 0;
    for (int x = int(middle.min().x()); x < int(middle.max().x()); ++x) {
      length = picture.at(x, y) < 160 ? length + 1 : 0;
      longest = std::max(longest, length);
    }
  }
  return longest;
}

TEST_F(BoardPage, hasARulerOfTheLengthItClaims) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd}) {
    SCOPED_TRACE(testing::Message() << size.transpose());
    write(makeBoard(size));
    const SheetPicture page = rasterized(200);
    const Tag& first = board_.tags.front();
    const double side = (first.corners[1] - first.corners[0]).norm();
    const Eigen::Vector2d inner = first.corners[2] + Eigen::Vector2d(side, -side) / kTagCells;
    const Eigen::AlignedBox2d middle(page.pixelOf(inner), page.pixelOf(-inner));
    // Half the thickness of the end marks on either side: 0.2 mm.
    const double pixel_m = 0.0254 / 200;
    EXPECT_NEAR(longestLine(page.picture, middle) * pixel_m, board_.ruler_m + 0.0002,
                1.5 * pixel_m);
    std::ostringstream caption;
    caption << "print at 100 %, no scaling; this ruler must measure "
            << std::lround(board_.ruler_m * 1e3) << " mm";
    EXPECT_NE(poppler("pdftotext", "-").find(caption.str()), std::string::npos);
  }
}

TEST_F(BoardPage, keepsTheWhiteRoundEveryTagFree) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd, Eigen::Vector2d(0.1, 0.1)}) {
    SCOPED_TRACE(testing::Message() << size.transpose());
    write(makeBoard(size));
    const SheetPicture page = rasterized(150);
    for (const Tag& tag : board_.tags) {
      const Eigen::Vector2d low = page.pixelOf(tag.corners[0]), high = page.pixelOf(tag.corners[2]);
      const double cell = (high.x() - low.x()) / kTagCells;
      for (int y = int(low.y() - cell + 2); y < int(high.y() + cell - 1); ++y) {
        for (int x = int(low.x() - cell + 2); x < int(high.x() + cell - 1); ++x) {
          const bool is_in_rim =
              x < low.x() - 1 || x > high.x() + 1 || y < low.y() - 1 || y > high.y() + 1;
          if (!is_in_rim) continue;
          ASSERT_EQ(page.picture.at(x, y), 255) << "tag " << tag.id;
        }
      }
    }
  }
}

}  // namespace
}  // namespace afterglow::calib::target_pictures_test
