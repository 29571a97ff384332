// Layouts of boards and patterns: what is where, and that nothing is in the way of anything.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>

#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib::targets_test {
namespace {

const Eigen::Vector2d kSheets[] = {{0.297, 0.210}, {0.420, 0.297}, {0.594, 0.420}, {1.189, 0.841},
                                   {0.210, 0.297}, {0.1, 0.1},     {0.3, 1.0},     {2.5, 5.0}};
const std::pair<int, int> kResolutions[] = {{320, 200},   {640, 480},   {854, 480},   {1280, 800},
                                            {1920, 1080}, {1080, 1920}, {3840, 2160}, {8192, 1024}};

double sideOf(const Tag& tag) { return (tag.corners[1] - tag.corners[0]).norm(); }

/// A tag with the white it needs round it.
Eigen::AlignedBox2d withRim(const Tag& tag) {
  const double cell = sideOf(tag) / kTagCells;
  Eigen::AlignedBox2d box(tag.corners[0]);
  for (const Eigen::Vector2d& corner : tag.corners) box.extend(corner);
  return {box.min().array() - cell, box.max().array() + cell};
}

void expectEachHasItsRim(const std::vector<Tag>& tags, const Eigen::AlignedBox2d& sheet) {
  const double touching = 1e-9 * sheet.sizes().maxCoeff();
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const Eigen::AlignedBox2d box = withRim(tags[i]);
    EXPECT_LT(sheet.exteriorDistance(box.min()), touching) << "tag " << tags[i].id;
    EXPECT_LT(sheet.exteriorDistance(box.max()), touching) << "tag " << tags[i].id;
    for (std::size_t j = 0; j < i; ++j) {
      const Eigen::Vector2d shared = box.intersection(withRim(tags[j])).sizes();
      EXPECT_FALSE((shared.array() > touching).all())
          << "tags " << tags[i].id << " and " << tags[j].id;
    }
  }
}

std::set<int> idsOf(const std::vector<Tag>& tags) {
  std::set<int> ids;
  for (const Tag& tag : tags) ids.insert(tag.id);
  EXPECT_EQ(ids.size(), tags.size()) << "an id twice";
  return ids;
}

template <typename Make>
std::string refusalOf(const Make& make) {
  try {
    make();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "not refused";
}

TEST(TagFamily, framesEveryTagInBlack) {
  for (const std::string& family : kTagFamilies) {
    std::set<TagCells> all;
    for (int id = 0; id < tagCount(family); id += 7) {
      const TagCells black = tagCells(family, id);
      for (std::size_t i = 0; i < kTagCells; ++i) {
        EXPECT_TRUE(black[0][i] && black[kTagCells - 1][i] && black[i][0] &&
                    black[i][kTagCells - 1])
            << family << " " << id;
      }
      EXPECT_TRUE(all.insert(black).second) << family << " " << id;
    }
  }
}

TEST(TagFamily, refusesWhatItDoesNotHave) {
  EXPECT_EQ(refusalOf([] { tagCells("tag36h11", 587); }),
            "tag36h11 has no tag 587: its ids are 0 to 586");
  EXPECT_EQ(refusalOf([] { tagCells("tag36h11", -1); }),
            "tag36h11 has no tag -1: its ids are 0 to 586");
  EXPECT_EQ(refusalOf([] { tagCount("aruco"); }),
            "unknown tag family \"aruco\": expected tag36h11 or tag36h10");
}

TEST(Board, givesEveryTagItsWhiteRimWithinTheSheet) {
  for (const Eigen::Vector2d& size : kSheets) {
    SCOPED_TRACE(testing::Message() << size.transpose());
    const Board board = makeBoard(size);
    EXPECT_EQ(board.size_m, size);
    EXPECT_GE(board.tags.size(), 12u);
    expectEachHasItsRim(board.tags, {-size / 2, size / 2});
  }
}

TEST(Board, isSymmetricWithAFreeMiddleOfHalfTheSheetEachWay) {
  for (const Eigen::Vector2d& size : kSheets) {
    SCOPED_TRACE(testing::Message() << size.transpose());
    const Board board = makeBoard(size);
    const Eigen::AlignedBox2d middle(-size / 4, size / 4);
    Eigen::AlignedBox2d hull;
    for (const Tag& tag : board.tags) {
      EXPECT_TRUE(middle.intersection(withRim(tag)).isEmpty()) << "tag " << tag.id;
      hull.extend(withRim(tag));
    }
    EXPECT_LT(hull.center().norm(), 1e-9);
    EXPECT_GT(board.ruler_m, 0);
    EXPECT_LT(board.ruler_m, 0.6 * size.x());
  }
}

TEST(Board, givesCornersFromTheTopLeftClockwise) {
  for (const Tag& tag : makeBoard({0.594, 0.42}).tags) {
    const Eigen::Vector2d right = tag.corners[1] - tag.corners[0];
    EXPECT_GT(right.x(), 0);
    EXPECT_LT((tag.corners[3] - tag.corners[0] - Eigen::Vector2d(0, -right.x())).norm(), 1e-12);
    EXPECT_LT((tag.corners[2] - tag.corners[1] - Eigen::Vector2d(0, -right.x())).norm(), 1e-12);
  }
}

TEST(Board, refusesUnusableSheets) {
  EXPECT_EQ(refusalOf([] {
              makeBoard({594, 420});
            }),
            "a board of 594 x 420 m: expected 0.1 to 5 m a side (meters, not millimeters)");
  EXPECT_EQ(refusalOf([] {
              makeBoard({0.05, 0.5});
            }),
            "a board of 0.05 x 0.5 m: expected 0.1 to 5 m a side (meters, not millimeters)");
  EXPECT_EQ(refusalOf([] {
              makeBoard({std::nan(""), 0.5});
            }),
            "a board of .nan x 0.5 m: expected 0.1 to 5 m a side (meters, not millimeters)");
  EXPECT_EQ(refusalOf([] {
              makeBoard({0.1, 5});
            }),
            "a board of 0.1 x 5 m is too narrow: its rim would need 532 tags, at most 100 are for "
            "boards");
}

TEST(Pattern, putsTagEdgesBetweenPixelsAndGivesEveryTagItsRim) {
  for (const auto& [width, height] : kResolutions) {
    SCOPED_TRACE(testing::Message() << width << " x " << height);
    const Pattern pattern = makePattern(width, height);
    EXPECT_GE(pattern.tags.size(), 20u);
    expectEachHasItsRim(pattern.tags,
                        {Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(width - 0.5, height - 0.5)});
    for (const Tag& tag : pattern.tags) {
      EXPECT_EQ(std::fmod(sideOf(tag), kTagCells), 0) << "cells are whole pixels";
      for (const Eigen::Vector2d& corner : tag.corners) {
        EXPECT_EQ(corner.x() - std::floor(corner.x()), 0.5);
        EXPECT_EQ(corner.y() - std::floor(corner.y()), 0.5);
      }
    }
  }
}

TEST(Pattern, hasLargeAndSmallTagsAllOverThePicture) {
  for (const auto& [width, height] : kResolutions) {
    SCOPED_TRACE(testing::Message() << width << " x " << height);
    std::set<double> sizes;
    Eigen::AlignedBox2d hull;
    for (const Tag& tag : makePattern(width, height).tags) {
      sizes.insert(sideOf(tag));
      hull.extend(withRim(tag));
    }
    ASSERT_EQ(sizes.size(), 2u);
    EXPECT_EQ(*sizes.rbegin(), 2 * *sizes.begin());
    EXPECT_GT(hull.sizes().x(), width - 3 * *sizes.rbegin());
    EXPECT_GT(hull.sizes().y(), height - 3 * *sizes.rbegin());
  }
}

TEST(Pattern, neverSharesAnIdWithABoard) {
  for (const std::string& family : kTagFamilies) {
    for (const Eigen::Vector2d& size : kSheets) {
      const std::set<int> ids = idsOf(makeBoard(size, family).tags);
      EXPECT_GE(*ids.begin(), 0);
      EXPECT_LT(*ids.rbegin(), kFirstPatternId);
    }
    for (const auto& [width, height] : kResolutions) {
      const std::set<int> ids = idsOf(makePattern(width, height, family).tags);
      EXPECT_GE(*ids.begin(), kFirstPatternId);
      EXPECT_LT(*ids.rbegin(), tagCount(family));
    }
  }
}

TEST(Board, hasIdsOfItsOwnForEveryPaperOfOneShape) {
  std::set<int> all;
  for (const Paper& paper : kPapers) {
    if (paper.name[0] != 'A') continue;
    const std::set<int> ids = idsOf(makeBoard(paper.size_m).tags);
    EXPECT_EQ(ids, idsOf(makeBoard(paper.size_m.reverse()).tags)) << paper.name;
    EXPECT_EQ(ids.size(), std::size_t(kPaperTags)) << paper.name;
    EXPECT_EQ(*ids.begin(), paper.first_id) << paper.name;
    all.insert(ids.begin(), ids.end());
  }
  EXPECT_EQ(all.size(), 5 * kPaperTags);
  EXPECT_EQ(makeBoard({0.594, 0.42}).tags.front().id, 0) << "A2 boards of before stay right";
  Board old = makeBoard({0.42, 0.297});
  EXPECT_EQ(unsureSizeText(old), "");
  for (Tag& tag : old.tags) tag.id -= 40;
  EXPECT_NE(unsureSizeText(old).find("nothing here tells whether the print is A3"),
            std::string::npos);
}

TEST(Board, ofAmericanPaperIsToldByItsShape) {
  const Board a2 = makeBoard({0.594, 0.42}), letter = makeBoard({0.2794, 0.2159}),
              tabloid = makeBoard({0.2794, 0.4318});
  EXPECT_EQ(boardName(letter), "Letter");
  EXPECT_EQ(boardName(tabloid), "Tabloid");
  EXPECT_EQ(letter.ruler_m, 0.1);
  const std::set<std::size_t> counts = {a2.tags.size(), letter.tags.size(), tabloid.tags.size()};
  EXPECT_EQ(counts.size(), 3u);
  EXPECT_EQ(unsureSizeText(letter) + unsureSizeText(tabloid), "");
}

TEST(Board, ofAnyOtherSheetIsToldBySheetAndRuler) {
  // Two of one shape have the same tags in the same places, but for the scale.
  const Board small = makeBoard({0.4, 0.3}), large = makeBoard({0.8, 0.6});
  EXPECT_EQ(idsOf(small.tags), idsOf(large.tags));
  EXPECT_GT(large.ruler_m, 1.9 * small.ruler_m);
}

TEST(Pattern, refusesPicturesThatNoProjectorHas) {
  EXPECT_EQ(refusalOf([] { makePattern(0, 800); }),
            "a pattern of 0 x 800 pixels: expected 320 x 200 to 8192 x 8192");
  EXPECT_EQ(refusalOf([] { makePattern(1280, 10000); }),
            "a pattern of 1280 x 10000 pixels: expected 320 x 200 to 8192 x 8192");
}

}  // namespace
}  // namespace afterglow::calib::targets_test
