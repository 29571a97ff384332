// Boards and patterns as files: the layouts read back, and the complaint about every kind of bad
// file. Pictures and printed pages: target_pictures_test.cpp.
#include "calib/targets/target_files.hpp"

#include <gtest/gtest.h>


#include "tests/support/temp_folder.hpp"

namespace afterglow::calib::target_files_test {
namespace {

using test::TempFolder;

const Eigen::Vector2d kA4(0.297, 0.210), kA2(0.594, 0.420), kOdd(0.2, 0.333);

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
    const Board board = makeBoard(size, kTagFamilies.back());
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

TEST(TargetFiles, sayWhichPathCannotBeWritten) {
  const TempFolder folder;
  test::writeFile(folder.path("file"), "not a folder");
  try {
    writeBoard(folder.path("file"), makeBoard(kA4));
    FAIL() << "written into a file";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(folder.path("file")), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(test::fileBytes(folder.path("file")), "not a folder");
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
  test::writeFile(path, good);
  ASSERT_NO_THROW(load(path));
  for (const BadFile& bad : bad_files) {
    const auto at = good.find(bad.from);
    ASSERT_NE(at, std::string::npos) << bad.from;
    std::string content = good;
    test::writeFile(path, content.replace(at, bad.from.size(), bad.to));
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
  test::writeFile(folder.path("b.yaml"), kBoard.substr(0, ruler) + kBoard.substr(tags));
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
}  // namespace afterglow::calib::target_files_test
