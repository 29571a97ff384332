// Boards and patterns as files: the layouts read back, pictures and printed pages that show what
// the layouts say, and the complaint about every kind of bad file.
#include "calib/targets/target_files.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>

#include "calib/detection/tag_detector.hpp"
#include "calib/targets/tag_family.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::calib {
namespace {

using test::TempFolder;

const Eigen::Vector2d kA4(0.297, 0.210), kA2(0.594, 0.420), kOdd(0.2, 0.333);

std::string contentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

void write(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

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

void expectSameTags(const std::vector<Tag>& actual, const std::vector<Tag>& expected,
                    double tolerance) {
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    EXPECT_EQ(actual[i].id, expected[i].id);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_LE((actual[i].corners[k] - expected[i].corners[k]).norm(), tolerance)
          << "corner " << k << " of tag " << actual[i].id;
    }
  }
}

TEST(BoardFile, givesBackTheBoardThatWasWritten) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd}) {
    const TempFolder folder;
    const Board board = makeBoard(size, "tag36h10");
    writeBoard(folder.path("made/for/it"), board);
    const Board read = loadBoard(folder.path("made/for/it/board.yaml"));
    EXPECT_EQ(read.family, board.family);
    EXPECT_EQ(read.size_m, board.size_m);
    EXPECT_EQ(read.ruler_m, board.ruler_m);
    expectSameTags(read.tags, board.tags, 1e-9);
  }
}

TEST(PatternFile, givesBackThePatternThatWasWritten) {
  const TempFolder folder;
  const Pattern pattern = makePattern(1280, 800);
  writePattern(folder.path("p"), pattern);
  const Pattern read = loadPattern(folder.path("p/pattern.yaml"));
  EXPECT_EQ(read.family, pattern.family);
  EXPECT_EQ(read.width, pattern.width);
  EXPECT_EQ(read.height, pattern.height);
  expectSameTags(read.tags, pattern.tags, 0);
}

// ------------------------------------------------------------------------------------- pictures

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
  const std::string png = contentOf(folder.path("board.png"));
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

TEST_F(BoardPage, isExactlyTheSheet) {
  for (const Eigen::Vector2d& size : {kA4, kA2, kOdd}) {
    write(makeBoard(size));
    double width = 0, height = 0;
    const std::string info = poppler("pdfinfo");
    const auto line = info.find("Page size:");
    ASSERT_NE(line, std::string::npos) << info;
    ASSERT_EQ(std::sscanf(info.c_str() + line, "Page size: %lf x %lf", &width, &height), 2);
    EXPECT_NE(info.find("Pages:           1\n"), std::string::npos) << info;
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
    const SheetPicture page = rasterized(300);
    const Tag& first = board_.tags.front();
    const double side = (first.corners[1] - first.corners[0]).norm();
    const Eigen::Vector2d inner = first.corners[2] + Eigen::Vector2d(side, -side) / kTagCells;
    const Eigen::AlignedBox2d middle(page.pixelOf(inner), page.pixelOf(-inner));
    // Half the thickness of the end marks on either side: 0.2 mm.
    const double pixel_m = 0.0254 / 300;
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

// -------------------------------------------------------------------------------------- bad files

TEST(TargetFiles, sayWhichPathCannotBeWritten) {
  const TempFolder folder;
  write(folder.path("file"), "not a folder");
  try {
    writeBoard(folder.path("file"), makeBoard(kA4));
    FAIL() << "written into a file";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(folder.path("file")), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(contentOf(folder.path("file")), "not a folder");
}

const std::string kBoard =
    "family: tag36h11\n"
    "size_m: [0.4, 0.3]\n"
    "ruler_m: 0.1\n"
    "picture: board.png\n"
    "tags:\n"
    "  - {id: 0, corners: [[-0.1, 0.1, 0], [-0.05, 0.1, 0], [-0.05, 0.05, 0], [-0.1, 0.05, 0]]}\n"
    "  - {id: 1, corners: [[0.1, 0.1, 0], [0.15, 0.1, 0], [0.15, 0.05, 0], [0.1, 0.05, 0]]}\n";
const std::string kPattern =
    "family: tag36h11\n"
    "width: 640\n"
    "height: 480\n"
    "picture: pattern.png\n"
    "tags:\n"
    "  - {id: 100, corners: [[9.5, 9.5], [49.5, 9.5], [49.5, 49.5], [9.5, 49.5]]}\n";

/// A file with one thing changed, and what is said about it after the file's name.
struct BadFile {
  std::string from, to, complaint;
};

template <typename Load>
void expectComplaints(const std::string& good, const std::vector<BadFile>& bad_files,
                      const Load& load) {
  const TempFolder folder;
  const std::string path = folder.path("layout.yaml");
  write(path, good);
  ASSERT_NO_THROW(load(path));
  for (const BadFile& bad : bad_files) {
    const auto at = good.find(bad.from);
    ASSERT_NE(at, std::string::npos) << bad.from;
    std::string content = good;
    write(path, content.replace(at, bad.from.size(), bad.to));
    try {
      load(path);
      ADD_FAILURE() << "read in spite of " << bad.to;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()), path + bad.complaint) << bad.to;
    }
  }
}

TEST(BoardFile, mayLeaveOutRulerAndPicture) {
  const TempFolder folder;
  const auto ruler = kBoard.find("ruler_m"), tags = kBoard.find("tags:");
  write(folder.path("b.yaml"), kBoard.substr(0, ruler) + kBoard.substr(tags));
  EXPECT_EQ(loadBoard(folder.path("b.yaml")).ruler_m, 0);
}

TEST(BoardFile, isRefusedWithLineAndReason) {
  const std::vector<BadFile> bad_files = {
      {kBoard, "",
       ": a board should be a map with the keys family, size_m, ruler_m, picture, tags"},
      {kBoard, "- 1\n",
       ":1: a board should be a map with the keys family, size_m, ruler_m, picture, tags"},
      {"size_m: [0.4, 0.3]", "size_m: [0.4, 0.3", ":3: end of sequence flow not found"},
      {"family: tag36h11\n", "", ":1: no 'family' in a board"},
      {"size_m: [0.4, 0.3]\n", "", ":1: no 'size_m' in a board"},
      {kBoard.substr(kBoard.find("tags:")), "", ":1: no 'tags' in a board"},
      {"ruler_m", "ruler",
       ":3: unknown key 'ruler' in a board; known: family, size_m, ruler_m, picture, tags"},
      {"ruler_m: 0.1", "family: tag36h10", ":3: key 'family' twice in a board"},
      {"tag36h11", "tag25h9", ":1: unknown tag family \"tag25h9\": expected tag36h11 or tag36h10"},
      {"tag36h11", "[]", ":1: 'family' should be a text"},
      {"board.png", "\"\"", ":4: 'picture' should be a text"},
      {"[0.4, 0.3]", "[400, 300]",
       ":2: 'size_m' is 400 x 300, which looks like millimeters: in meters that is [0.4, 0.3]"},
      {"[0.4, 0.3]", "[0.4, 0]", ":2: 'size_m' is 0.4 x 0: expected two sides above 0"},
      {"[0.4, 0.3]", "[0.4, .nan]", ":2: every number of 'size_m' should be a finite number"},
      {"[0.4, 0.3]", "[0.4, \"0,3\"]", ":2: every number of 'size_m' should be a finite number"},
      {"[0.4, 0.3]", "[0.4]", ":2: 'size_m' should be 2 numbers in brackets"},
      {"[0.4, 0.3]", "0.4", ":2: 'size_m' should be 2 numbers in brackets"},
      {"ruler_m: 0.1", "ruler_m: 100",
       ":3: 'ruler_m' is 100, which looks like millimeters: in meters that is 0.1"},
      {"ruler_m: 0.1", "ruler_m: 0.5",
       ":3: 'ruler_m' is 0.5: expected 0 (none) to 0.4, the sheet's longer side"},
      {"ruler_m: 0.1", "ruler_m: ten", ":3: 'ruler_m' should be a finite number"},
      {kBoard.substr(kBoard.find("tags:")), "tags: []\n",
       ":5: 'tags' should be a list of {id, corners}"},
      {"{id: 0, ", "{", ":6: no 'id' in a tag"},
      {"{id: 0, ", "{id: 0, size: 1, ", ":6: unknown key 'size' in a tag; known: id, corners"},
      {"id: 1", "id: 0", ":7: tag 0 twice"},
      {"id: 1", "id: 1.5", ":7: 'id' should be a whole number"},
      {"id: 1", "id: 587", ":7: tag36h11 has no tag 587: its ids are 0 to 586"},
      {"id: 1", "id: -1", ":7: tag36h11 has no tag -1: its ids are 0 to 586"},
      {"id: 1", "id: 100", ":7: tag 100 on a board: ids from 100 on are the projected pattern's"},
      {", [-0.1, 0.05, 0]]", "]",
       ":6: 'corners' of tag 0 should be four: top left, top right, bottom right, bottom left"},
      {"[-0.1, 0.1, 0]", "[-0.1, 0.1]", ":6: a corner of tag 0 should be 3 numbers in brackets"},
      {"[-0.1, 0.1, 0]", "[-0.1, x, 0]",
       ":6: every number of a corner of tag 0 should be a finite number"},
      {"[-0.1, 0.1, 0]", "[-0.1, 0.1, 0.01]",
       ":6: a corner of tag 0 has z 0.01: on a board z is 0"},
      {"[-0.1, 0.1, 0]", "[-100, 100, 0]",
       ":6: a corner of tag 0 is (-100, 100), which looks like millimeters: corners are in meters"},
      {"[-0.1, 0.1, 0]", "[-0.3, 0.1, 0]",
       ":6: a corner of tag 0 lies outside the sheet, which goes from (-0.2, -0.15) to (0.2, "
       "0.15)"},
      {"[-0.1, 0.1, 0]", "[-0.12, 0.1, 0]", ":6: the corners of tag 0 are no square"},
      {"[[-0.1, 0.1, 0], [-0.05, 0.1, 0], [-0.05, 0.05, 0], [-0.1, 0.05, 0]]",
       "[[-0.05, 0.1, 0], [-0.1, 0.1, 0], [-0.1, 0.05, 0], [-0.05, 0.05, 0]]",
       ":6: tag 0 is mirrored: expected its corners as top left, top right, bottom right, bottom "
       "left"},
      {"[[0.1, 0.1, 0], [0.15, 0.1, 0], [0.15, 0.05, 0], [0.1, 0.05, 0]]",
       "[[-0.08, 0.1, 0], [-0.03, 0.1, 0], [-0.03, 0.05, 0], [-0.08, 0.05, 0]]",
       ":7: tags 0 and 1 overlap"},
  };
  expectComplaints(kBoard, bad_files, loadBoard);
}

TEST(PatternFile, isRefusedWithLineAndReason) {
  const std::vector<BadFile> bad_files = {
      {"width: 640\n", "", ":1: no 'width' in a pattern"},
      {"width: 640", "width: 640.5", ":2: 'width' should be a whole number"},
      {"height: 480", "height: 0", ":3: 'height' is 0: expected a projector's pixels"},
      {"height", "size_m",
       ":3: unknown key 'size_m' in a pattern; known: family, width, height, picture, tags"},
      {"id: 100", "id: 99", ":6: tag 99 on a pattern: ids below 100 are the printed board's"},
      {"[9.5, 9.5]", "[9.5, 9.5, 0]", ":6: a corner of tag 100 should be 2 numbers in brackets"},
      {"width: 640", "width: 40",
       ":6: a corner of tag 100 lies outside the picture, which goes from (-0.5, -0.5) to (39.5, "
       "479.5)"},
      {"[[9.5, 9.5], [49.5, 9.5], [49.5, 49.5], [9.5, 49.5]]",
       "[[9.5, 49.5], [49.5, 49.5], [49.5, 9.5], [9.5, 9.5]]",
       ":6: tag 100 is mirrored: expected its corners as top left, top right, bottom right, bottom "
       "left"},
  };
  expectComplaints(kPattern, bad_files, loadPattern);
}

TEST(BoardFile, thatIsNotThereIsSaidToBe) {
  for (const std::string path : {"/nowhere/board.yaml", "/tmp"}) {
    try {
      loadBoard(path);
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()), path + ": cannot be read");
    }
  }
}

}  // namespace
}  // namespace afterglow::calib
