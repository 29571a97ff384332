// Text through the lens: size and place against cv::projectPoints, letters against OpenCV's, and
// which way up they lie on a floor.
#include <gtest/gtest.h>

#include <memory>
#include <opencv2/freetype.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "render/scene/typeface.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::text_gl_test {
namespace {

const char kFont[] = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

Rigid<World, World> at(const Eigen::Vector3d& p) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = p;
  T.linear() = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  return Rigid<World, World>(T);  // its orientation says nothing
}

/// Rows and columns where half of a pixel's light begins and ends, to a fraction of a pixel, of
/// content whose edges are straight.
struct Extent {
  double left, right, top, bottom;
};

Extent extentOf(const cv::Mat& image) {
  cv::Mat columns, rows;
  cv::reduce(image, columns, 0, cv::REDUCE_MAX);
  cv::reduce(image, rows, 1, cv::REDUCE_MAX);
  const auto edges = [](const cv::Mat& line, double& first, double& last) {
    const int n = static_cast<int>(line.total());
    int i = 0, j = n - 1;
    while (i < n && line.at<std::uint8_t>(i) < 1) ++i;
    while (j >= 0 && line.at<std::uint8_t>(j) < 1) --j;
    first = i + 0.5 - line.at<std::uint8_t>(i) / 255.0;
    last = j - 0.5 + line.at<std::uint8_t>(j) / 255.0;
  };
  Extent extent{};
  edges(columns, extent.left, extent.right);
  edges(rows, extent.top, extent.bottom);
  return extent;
}

cv::Mat gray(const Image& image) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.rgb.data()));
  cv::Mat gray;
  cv::extractChannel(rgb, gray, 1);
  return gray;
}

class ProjectedText : public test::GlTest {
 protected:
  Text text(const std::u32string& letters, double height) {
    return {std::make_shared<const Body>(typeface_.block(letters, height))};
  }
  Image draw(const calib::Lens& lens, Layer layer, const Rigid<Projector, World>& T = {}) {
    return ProjectorRenderer(context(), lens).render({{std::move(layer)}}, T);
  }
  Image draw(const calib::Lens& lens, const Text& text, const Eigen::Vector3d& p) {
    Layer layer;
    layer.drawables = {{at(p), text, {}}};
    return draw(lens, layer);
  }

  Typeface typeface_;
};

TEST_F(ProjectedText, isAsHighAsItSaysWhereItSays) {
  for (const double f : {400.0, 1900.0}) {
    const calib::Lens lens = test::lens(1280, 800, f, 600.3, 380.7);
    const Eigen::Vector3d p(0.05, -0.03, 1.5);
    const double height = 0.12;
    const Extent found = extentOf(gray(draw(lens, text(U"H", height), p)));
    const auto ends = test::projectWithOpenCv(
        lens, {p - Eigen::Vector3d(0, height / 2, 0), p + Eigen::Vector3d(0, height / 2, 0)});
    EXPECT_NEAR(found.top, ends[0].y(), 0.3) << f;
    EXPECT_NEAR(found.bottom, ends[1].y(), 0.3) << f;
    EXPECT_NEAR((found.left + found.right) / 2, ends[0].x(), 0.02 * height * f) << f;
    // The next line lies a pitch lower, and the block stays centered.
    const Extent lines = extentOf(gray(draw(lens, text(U"H\nH", height / 2), p)));
    EXPECT_NEAR((lines.top + lines.bottom) / 2, (ends[0].y() + ends[1].y()) / 2, 0.3) << f;
    EXPECT_NEAR((lines.bottom - lines.top) / (found.bottom - found.top), 0.5 * (1 + 1.164 / 0.729),
                0.02)
        << f;
  }
}

TEST_F(ProjectedText, bendsWithTheLens) {
  const calib::Lens lens = test::lens(1280, 800, 900, 640, 400, {-0.3, 0.05, 0, 0, 0});
  const Eigen::Vector3d p(0.5, 0.3, 1);
  const Body bar = typeface_.block(U"\u2588", 0.2);  // a rectangle
  Eigen::AlignedBox3f box;
  for (const auto& q : bar.points) box.extend(q);
  const Image image = draw(lens, Text{std::make_shared<const Body>(bar)}, p);
  std::vector<Eigen::Vector3d> rim;
  const Eigen::Vector3f corners[] = {
      box.min(), {box.max().x(), box.min().y(), 0}, box.max(), {box.min().x(), box.max().y(), 0}};
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 100; ++k) {
      const Eigen::Vector3f q = corners[i] + (corners[(i + 1) % 4] - corners[i]) * (k / 100.f);
      rim.push_back(p + Eigen::Vector3d(q.x(), -q.y(), 0));
    }
  }
  std::vector<cv::Point2f> outline;
  for (const Eigen::Vector2d& pixel : test::projectWithOpenCv(lens, rim)) {
    outline.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  const cv::Moments moments = cv::moments(outline);
  const auto found = test::centroid(image, {640, 400}, 700);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - Eigen::Vector2d(moments.m10, moments.m01) / moments.m00).norm(), 0.1);
  EXPECT_NEAR(test::whiteArea(image) / moments.m00, 1, 0.003);
}

TEST_F(ProjectedText, looksLikeOpenCvsLetters) {
  const int em = 96;
  const std::string letters = "Rgb&8@%aeQ";
  const calib::Lens lens = test::lens(1280, 200, 1000, 639.5, 99.5);
  const Image image = draw(lens, text(U"Rgb&8@%aeQ", em * 1493.0 / 2048 / 1000), {0, 0, 1});
  cv::Mat theirs = cv::Mat::zeros(200, 1280, CV_8UC3), ours = gray(image);
  auto freetype = cv::freetype::createFreeType2();
  freetype->loadFontData(kFont, 0);
  freetype->putText(theirs, letters, {200, 150}, em, cv::Scalar::all(255), -1, cv::LINE_AA, true);
  cv::extractChannel(theirs, theirs, 0);
  const cv::Rect our_box = cv::boundingRect(ours > 127), their_box = cv::boundingRect(theirs > 127);
  EXPECT_NEAR(our_box.height, their_box.height, 2);
  EXPECT_NEAR(our_box.width, their_box.width, 8);  // they round each advance to pixels
  // Letter by letter, each moved to where it fits best.
  int different = 0, lit = 0;
  for (const char letter : letters) {
    cv::Mat a = gray(
        draw(lens, text({static_cast<char32_t>(letter)}, em * 1493.0 / 2048 / 1000), {0, 0, 1}));
    cv::Mat b = cv::Mat::zeros(200, 1280, CV_8UC3);
    freetype->putText(b, std::string(1, letter), {600, 150}, em, cv::Scalar::all(255), -1,
                      cv::LINE_AA, true);
    cv::extractChannel(b, b, 0);
    a = a > 127;
    b = b > 127;
    const cv::Rect box = cv::boundingRect(a), other = cv::boundingRect(b);
    const cv::Size size(box.width + 4, box.height + 4);
    int best = 1 << 30;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const cv::Mat ours_cut = a({box.tl() - cv::Point(2, 2), size});
        const cv::Mat theirs_cut = b({other.tl() - cv::Point(2 + dx, 2 + dy), size});
        best = std::min(best, cv::countNonZero(ours_cut != theirs_cut));
      }
    }
    different += best;
    lit += cv::countNonZero(a);
  }
  EXPECT_LT(different, 0.1 * lit);  // pixels along rims
}

/// Where the foot of an L is, seen from its middle, on the floor: the L's longer arm goes up.
TEST_F(ProjectedText, liesOnTheFloorForItsReader) {
  // Straight above the floor; the picture's top is the world's +y.
  const auto T = test::lookAt<Projector>({0, 0, 2}, {0, 0, 0}, {0, 1, 0}).inverse();
  const calib::Lens lens = test::lens(401, 401, 400, 200, 200);
  Layer layer;
  layer.placement = Placement::Drape;
  layer.surface = SurfacePatch{"floor", {}, {}};
  layer.drawables = {{at({0, 0, 0.7}), text(U"T", 0.5), {}}};
  const auto bar = [&] {  // from the middle of the picture toward the T's bar, in the world
    const auto found = test::centroid(draw(lens, layer, T), {200, 200}, 199);
    return Eigen::Vector2d(found->x() - 200, 200 - found->y()).normalized();
  };
  EXPECT_GT(bar().y(), 0.98);  // read from -y
  layer.reader = Reader{{0, 5, 1.7}, false};
  EXPECT_LT(bar().y(), -0.98);  // by a person at +y
  layer.reader = Reader{{1, 0, 0}, true};
  EXPECT_LT(bar().x(), -0.98);  // from the side where +x is
  layer.reader = Reader{{3, -3, 0}, false};
  EXPECT_LT((bar() - Eigen::Vector2d(-1, 1).normalized()).norm(), 0.1);
  // And it is never mirrored: an L's foot lies to the right of its stem for the reader.
  layer.reader = Reader{{0, 5, 1.7}, false};
  layer.drawables = {{at({0, 0, 0.7}), text(U"L", 0.5), {}}};
  const cv::Mat picture = gray(draw(lens, layer, T));
  const cv::Rect box = cv::boundingRect(picture > 127);
  const auto lit = [&](double x, double y) {
    return picture.at<std::uint8_t>(static_cast<int>(box.y + y * box.height),
                                    static_cast<int>(box.x + x * box.width)) > 127;
  };
  EXPECT_TRUE(lit(0.1, 0.05));  // turned by 180 degrees: the foot is at the top, to the left
  EXPECT_TRUE(lit(0.95, 0.9));
  EXPECT_FALSE(lit(0.1, 0.9));
}

TEST_F(ProjectedText, facesTheViewerItIsPlacedFor) {
  // Seen from the viewer's eye through a camera there, the text on the floor stands upright.
  const Eigen::Vector3d eye(0, -3, 1.7), p(0.2, 0, 0.5);
  const auto T_projector_world = test::lookAt<Projector>(eye, p).inverse();
  const calib::Lens lens = test::lens(801, 601, 800, 400, 300);
  Layer layer;
  layer.placement = Placement::Viewer;
  layer.surface = SurfacePatch{"floor", {}, {}};
  layer.p_viewer = eye;
  layer.drawables = {{at(p), text(U"H", 0.3), {}}};
  const Extent found = extentOf(gray(draw(lens, layer, T_projector_world)));
  const double height_px = 0.3 * 800 / (p - eye).norm();
  EXPECT_NEAR(found.bottom - found.top, height_px, 0.3);
  EXPECT_NEAR((found.bottom + found.top) / 2, 300, 0.3);
}

}  // namespace
}  // namespace afterglow::render::text_gl_test
