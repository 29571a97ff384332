#include "calib/targets/board_drawing.hpp"

#include <cairo-pdf.h>
#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/picture.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {
namespace {

constexpr double kPixelsPerMeter = 2000;
constexpr double kMostPixels = 4000;  ///< along a side of the picture
constexpr double kPointsPerMeter = 72 / 0.0254;

/// Everything but the tags, in mm.
constexpr double kLine = 0.2;
constexpr double kMillimeterTick = 1.8, kFiveTick = 3, kTenTick = 4.5;
constexpr double kGap = 1;
constexpr double kNumberFont = 2.6, kLargestFont = 4;
constexpr double kTextGray = 0.4;

using Surface = std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)>;

struct Point {
  double x, y;
};

/// Draws in millimeters, origin in the sheet's middle, y down.
class Pen {
 public:
  /// `scale`: the surface's units per meter.
  Pen(cairo_surface_t* surface, const Eigen::Vector2d& size_m, const Eigen::Vector2d& scale)
      : cairo_(cairo_create(surface), cairo_destroy) {
    cairo_scale(get(), scale.x() / 1000, scale.y() / 1000);
    cairo_translate(get(), size_m.x() * 500, size_m.y() * 500);
    cairo_select_font_face(get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    // The same gray letters at every resolution.
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(get(), options);
    cairo_font_options_destroy(options);
    setGray(0);
  }

  void setGray(double gray) { cairo_set_source_rgb(get(), gray, gray, gray); }

  void line(Point from, Point to) {
    cairo_set_line_width(get(), kLine);
    cairo_move_to(get(), from.x, from.y);
    cairo_line_to(get(), to.x, to.y);
    cairo_stroke(get());
  }

  void triangle(Point a, Point b, Point c) {
    cairo_move_to(get(), a.x, a.y);
    cairo_line_to(get(), b.x, b.y);
    cairo_line_to(get(), c.x, c.y);
    cairo_close_path(get());
    cairo_fill(get());
  }

  double textWidth(const std::string& text, double font) {
    cairo_text_extents_t extents;
    cairo_set_font_size(get(), font);
    cairo_text_extents(get(), text.c_str(), &extents);
    return extents.width;
  }

  /// `anchor`: which part of the text's ink is at the point, (0, 0) its top left, (1, 1) its
  /// bottom right.
  void text(Point at, Point anchor, const std::string& text, double font) {
    cairo_text_extents_t extents;
    cairo_set_font_size(get(), font);
    cairo_text_extents(get(), text.c_str(), &extents);
    cairo_move_to(get(), at.x - extents.x_bearing - anchor.x * extents.width,
                  at.y - extents.y_bearing - anchor.y * extents.height);
    cairo_show_text(get(), text.c_str());
  }

  /// Draws one path for each tag: separate cells would leave hairlines between them.
  void tag(const Tag& tag, const TagCells& black) {
    const Eigen::Vector2d origin = tag.corners[0] * 1e3;
    const Eigen::Vector2d right = (tag.corners[1] - tag.corners[0]) * 1e3 / kTagCells;
    const Eigen::Vector2d down = (tag.corners[3] - tag.corners[0]) * 1e3 / kTagCells;
    cairo_save(get());
    const cairo_matrix_t cells{right.x(), -right.y(), down.x(), -down.y(), origin.x(), -origin.y()};
    cairo_transform(get(), &cells);
    for (int row = 0; row < kTagCells; ++row) addRuns(row, black[static_cast<std::size_t>(row)]);
    cairo_fill(get());
    cairo_restore(get());
  }

  /// Drawing calls never fail by themselves: cairo remembers the first error.
  void check() { throwUnlessFine(cairo_status(get())); }
  static void throwUnlessFine(cairo_status_t status) {
    if (status == CAIRO_STATUS_SUCCESS) return;
    throw std::runtime_error(std::string("the board cannot be drawn: ") +
                             cairo_status_to_string(status));
  }

 private:
  cairo_t* get() { return cairo_.get(); }

  void addRuns(int row, const std::array<bool, kTagCells>& black) {
    for (int begin = 0; begin < kTagCells;) {
      int end = begin;
      while (end < kTagCells && black[static_cast<std::size_t>(end)]) ++end;
      if (end > begin) {
        cairo_move_to(get(), begin, row);
        cairo_line_to(get(), end, row);
        cairo_line_to(get(), end, row + 1);
        cairo_line_to(get(), begin, row + 1);
        cairo_close_path(get());
      }
      begin = end + 1;
    }
  }

  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

/// The middle within the tags and their white rims, in the pen's mm.
struct Middle {
  double left, right, top, bottom;
  double font;  ///< font size of ids
};

Middle middleOf(const Board& board) {
  double side = 0;
  Eigen::Vector2d reach = Eigen::Vector2d::Zero();
  for (const Tag& tag : board.tags) {
    side = std::max(side, (tag.corners[1] - tag.corners[0]).norm());
    for (const Eigen::Vector2d& corner : tag.corners) reach = reach.cwiseMax(corner.cwiseAbs());
  }
  const double cell = side / kTagCells;
  const Eigen::Vector2d half = (reach.array() - side - cell) * 1e3;
  return {-half.x(), half.x(), -half.y(), half.y(), std::clamp(cell * 500, 1.6, kLargestFont)};
}

/// Beside its tag, where the tag's white rim ends and the free middle begins; a corner's tag is
/// pointed at, as its neighbors are as near.
void drawId(Pen& pen, const Middle& middle, const Tag& tag) {
  const Eigen::Vector2d center = (tag.corners[0] + tag.corners[2]) * 500;
  const Point at{std::clamp(center.x(), middle.left, middle.right),
                 std::clamp(-center.y(), middle.top, middle.bottom)};
  const auto anchor = [](double value, double low, double high) {
    return value <= low ? 0 : value >= high ? 1 : 0.5;
  };
  const Point side{anchor(at.x, middle.left, middle.right),
                   anchor(at.y, middle.top, middle.bottom)};
  Point text = at;
  if (side.x != 0.5 && side.y != 0.5) {
    const Point inward{(1 - 2 * side.x) * middle.font / 2, (1 - 2 * side.y) * middle.font / 2};
    pen.triangle(at, {at.x + inward.x, at.y}, {at.x, at.y + inward.y});
    text = {at.x + 0.7 * inward.x, at.y + 0.7 * inward.y};
  }
  pen.text(text, side, std::to_string(tag.id), middle.font);
}

std::string millimeters(double meters) { return exactText(std::round(meters * 1e4) / 10); }

/// The mark of the upper side, and the board's name.
void drawTitle(Pen& pen, const Middle& middle, const Board& board) {
  const double side = (board.tags.front().corners[1] - board.tags.front().corners[0]).norm();
  const std::string title = "this side up   " + board.family + ", sheet " +
                            millimeters(board.size_m.x()) + " x " + millimeters(board.size_m.y()) +
                            " mm, tags " + millimeters(side) + " mm";
  const double room = (middle.right - middle.left) * 0.9;
  const double font = std::min(middle.font * 0.8, room / pen.textWidth(title + " ^  ", 1));
  const double arrow = font, width = arrow * 1.4 + pen.textWidth(title, font);
  const double top = middle.top + middle.font + kGap, left = -width / 2;
  pen.triangle({left, top + arrow * 0.8}, {left + arrow, top + arrow * 0.8},
               {left + arrow / 2, top});
  pen.text({left + arrow * 1.4, top}, {0, 0}, title, font);
}

/// Ticks every millimeter, numbers every ten.
void drawScale(Pen& pen, double left, double base, int length_mm) {
  const double font = std::min(kNumberFont, length_mm / 25.0);  // room for those of a short ruler
  pen.line({left - kLine / 2, base}, {left + length_mm + kLine / 2, base});
  for (int mm = 0; mm <= length_mm; ++mm) {
    const double tick = mm % 10 == 0 ? kTenTick : mm % 5 == 0 ? kFiveTick : kMillimeterTick;
    pen.line({left + mm, base}, {left + mm, base - tick});
    if (mm % 10 == 0) {
      pen.text({left + mm, base - kTenTick - kGap / 2}, {0.5, 1}, std::to_string(mm), font);
    }
  }
}

/// The scale, and below it, between arrows that touch its ends, its purpose.
void drawRuler(Pen& pen, const Middle& middle, double ruler_m) {
  const int length_mm = static_cast<int>(std::lround(ruler_m * 1e3));
  const std::string caption =
      "print at 100 %, no scaling; this ruler must measure " + std::to_string(length_mm) + " mm";
  constexpr double kArrow = 3, kShaft = 4;
  const double left = -length_mm / 2.0, right = length_mm / 2.0;
  const double font =
      std::min(kLargestFont, (length_mm - 2 * (kArrow + kShaft)) / pen.textWidth(caption, 1));
  const double text_y = middle.bottom - middle.font - kGap - font / 2;
  const double base = text_y - std::max(font * 0.5, 1.0) - kGap;
  drawScale(pen, left, base, length_mm);
  for (const double end : {left, right}) {
    const double inward = end < 0 ? 1 : -1;
    pen.line({end, base}, {end, text_y + 1.5});
    pen.triangle({end, text_y}, {end + inward * kArrow, text_y - 1},
                 {end + inward * kArrow, text_y + 1});
    pen.line({end + inward * kArrow, text_y},
             {inward * -(pen.textWidth(caption, font) / 2 + kGap), text_y});
  }
  pen.text({0, text_y}, {0.5, 0.5}, caption, font);
}

void draw(cairo_surface_t* surface, const Board& board, const Eigen::Vector2d& scale) {
  Pen pen(surface, board.size_m, scale);
  for (const Tag& tag : board.tags) pen.tag(tag, tagCells(board.family, tag.id));
  if (!board.tags.empty()) {
    const Middle middle = middleOf(board);
    if (board.ruler_m > 0) drawRuler(pen, middle, board.ruler_m);
    pen.setGray(kTextGray);
    for (const Tag& tag : board.tags) drawId(pen, middle, tag);
    drawTitle(pen, middle, board);
  }
  pen.check();
}

cairo_status_t append(void* text, const unsigned char* bytes, unsigned count) {
  static_cast<std::string*>(text)->append(bytes, bytes + count);
  return CAIRO_STATUS_SUCCESS;
}

/// Returns a gray picture: the red of what was drawn in grays only.
Picture grayOf(cairo_surface_t* surface) {
  cairo_surface_flush(surface);
  Picture picture;
  picture.width = cairo_image_surface_get_width(surface);
  picture.height = cairo_image_surface_get_height(surface);
  const unsigned char* row = cairo_image_surface_get_data(surface);
  for (int y = 0; y < picture.height; ++y, row += cairo_image_surface_get_stride(surface)) {
    for (int x = 0; x < picture.width; ++x) picture.pixels.push_back(row[4 * x + 1]);
  }
  return picture;
}

Picture boardPicture(const Board& board) {
  const double pixels_per_m = std::min(kPixelsPerMeter, kMostPixels / board.size_m.maxCoeff());
  const Eigen::Vector2d pixels = (board.size_m * pixels_per_m).array().round().max(1);
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(pixels.x()),
                                                   static_cast<int>(pixels.y())),
                        cairo_surface_destroy);
  const std::unique_ptr<cairo_t, void (*)(cairo_t*)> paper(cairo_create(surface.get()),
                                                           cairo_destroy);
  cairo_set_source_rgb(paper.get(), 1, 1, 1);
  cairo_paint(paper.get());
  draw(surface.get(), board, pixels.cwiseQuotient(board.size_m));
  return grayOf(surface.get());
}

}  // namespace

std::string boardPdf(const Board& board) {
  std::string pdf;
  const Surface surface(
      cairo_pdf_surface_create_for_stream(append, &pdf, board.size_m.x() * kPointsPerMeter,
                                          board.size_m.y() * kPointsPerMeter),
      cairo_surface_destroy);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE,
                                 "Calibration board: print at 100 %, no scaling");
  draw(surface.get(), board, Eigen::Vector2d::Constant(kPointsPerMeter));
  cairo_surface_finish(surface.get());
  Pen::throwUnlessFine(cairo_surface_status(surface.get()));
  return pdf;
}

std::string boardPng(const Board& board) { return encodePng(boardPicture(board), board.size_m); }

}  // namespace afterglow::calib
