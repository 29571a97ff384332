#include "nodes/observer/caption.hpp"

#include <algorithm>
#include <filesystem>
#include <opencv2/freetype.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

const cv::Scalar kWhite(255, 255, 255), kPale(150, 215, 255), kWarm(255, 214, 120),
    kDark(12, 14, 18), kGhost(165, 180, 195);
constexpr const char* kGhostLegend = "gray: stood there then, is gone now";
constexpr int kSteps = 8;      // that the lit part is found in, across the image
constexpr int kLitLevel = 24;  // of 255: less is no light to look at

cv::Mat pixelsOf(render::Image& image) {
  return {image.height, image.width, CV_8UC3, image.rgb.data()};
}

void darken(cv::Mat pixels, double opacity) { pixels = pixels * (1 - opacity) + kDark * opacity; }

/// The same word always has the same color; the present glows like the light it is about.
cv::Scalar tagColor(const std::string& tag) {
  return tag == "NOW" ? cv::Scalar(236, 110, 20) : cv::Scalar(30, 120, 190);
}

/// Returns a line, without what a font has no glyph for.
std::string printableLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

}  // namespace

struct CaptionPainter::Impl {
  cv::Ptr<cv::freetype::FreeType2> font = cv::freetype::createFreeType2();

  int widthOf(const std::string& text, int height) {
    int baseline = 0;
    return font->getTextSize(text, height, -1, &baseline).width;
  }
  /// The largest height up to `height` at which the text is at most `width` wide.
  int heightFor(const std::string& text, int height, int width) {
    while (height > 8 && widthOf(text, height) > width) --height;
    return height;
  }
  /// `origin`: left end of the baseline.
  void write(const cv::Mat& pixels, const std::string& text, cv::Point origin, int height,
             const cv::Scalar& color) {
    font->putText(pixels, text, origin, height, color, -1, cv::LINE_AA, true);
  }
  /// Writes the tag; returns where the text may go on.
  int writeTag(const cv::Mat& pixels, const std::string& tag, cv::Point origin, int height);
  /// Writes smaller where it would reach beyond `right`.
  void writeLine(const cv::Mat& pixels, const std::string& text, cv::Point origin, int right,
                 int height, const cv::Scalar& color);
  /// Writes at the line's right end, the baseline at `y`; returns where it begins.
  int writeLegend(const cv::Mat& pixels, const std::string& text, int y, int height);
};

int CaptionPainter::Impl::writeTag(const cv::Mat& pixels, const std::string& tag, cv::Point origin,
                                   int height) {
  const int pad = height / 2, width = widthOf(tag, height);
  cv::rectangle(pixels, {origin.x, origin.y - height - pad / 2},
                {origin.x + width + 2 * pad, origin.y + pad}, tagColor(tag), cv::FILLED);
  write(pixels, tag, {origin.x + pad, origin.y}, height, kWhite);
  return origin.x + width + 3 * pad;
}

void CaptionPainter::Impl::writeLine(const cv::Mat& pixels, const std::string& text,
                                     cv::Point origin, int right, int height,
                                     const cv::Scalar& color) {
  write(pixels, text, origin, heightFor(text, height, right - 2 * height - origin.x), color);
}

int CaptionPainter::Impl::writeLegend(const cv::Mat& pixels, const std::string& text, int y,
                                      int height) {
  const int small = std::max(7, height * 7 / 10);
  const int left = pixels.cols - height - widthOf(text, small);
  if (left < pixels.cols * 2 / 3) return pixels.cols;
  write(pixels, text, {left, y}, small, kGhost);
  return left;
}

int stripHeight(int width) { return std::max(16, width * 9 / 320 * 2); }

std::optional<ImagePart> litPart(const render::Image& image) {
  int left = kSteps, top = kSteps, right = -1, bottom = -1;  // in steps
  for (int v = 0; v < image.height; ++v) {
    const std::uint8_t* row = image.rgb.data() + static_cast<std::size_t>(v * image.width) * 3;
    for (int u = 0; u < image.width; ++u, row += 3) {
      if (std::max({row[0], row[1], row[2]}) < kLitLevel) continue;
      const int column = u * kSteps / image.width, line = v * kSteps / image.height;
      left = std::min(left, column), right = std::max(right, column);
      top = std::min(top, line), bottom = std::max(bottom, line);
    }
  }
  if (right < 0) return std::nullopt;
  const int size = std::max({right - left + 1, bottom - top + 1, 2});
  const int x = std::clamp((left + right + 1 - size) / 2, 0, kSteps - size);
  const int y = std::clamp((top + bottom + 1 - size) / 2, 0, kSteps - size);
  return ImagePart{x * image.width / kSteps, y * image.height / kSteps,
                   size * image.width / kSteps, size * image.height / kSteps};
}

std::string CaptionPainter::defaultFont() {
  return "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";
}

CaptionPainter::CaptionPainter(const std::string& font) : impl_(std::make_unique<Impl>()) {
  try {
    if (!std::filesystem::is_regular_file(font)) throw std::runtime_error("no such file");
    impl_->font->loadFontData(font, 0);
  } catch (const std::exception&) {
    throw std::runtime_error(font + ": cannot read the font (package fonts-dejavu-core)");
  }
}

CaptionPainter::~CaptionPainter() = default;

render::Image CaptionPainter::withStrip(const render::Image& image, const Caption& caption) {
  const int strip = stripHeight(image.width);
  render::Image whole{image.width, image.height + strip, image.rgb};
  whole.rgb.resize(image.rgb.size() + static_cast<std::size_t>(strip * image.width) * 3);
  cv::Mat pixels = pixelsOf(whole);
  pixels.rowRange(image.height, whole.height).setTo(kDark);
  const std::string tag = printableLine(caption.tag);
  const bool is_asked = !caption.asked.empty();
  const std::string text =
      is_asked ? "You: “" + printableLine(caption.asked) + "”" : printableLine(caption.text);
  const int height = std::max(7, strip * 2 / 7), line = strip * 9 / 20;
  cv::Point origin(height, image.height + line * 4 / 5);
  cv::Point after_tag = origin;
  if (!tag.empty()) after_tag.x = impl_->writeTag(pixels, tag, origin, height * 4 / 5);
  if (!text.empty()) {
    impl_->writeLine(pixels, text, after_tag, whole.width, height, is_asked ? kWarm : kWhite);
  }
  origin.y += line;
  const int right = caption.has_ghosts
                        ? impl_->writeLegend(pixels, kGhostLegend, origin.y, height)
                        : whole.width;
  if (caption.speech.empty()) return whole;
  const std::string speech = "Robot: “" + printableLine(caption.speech) + "”";
  impl_->writeLine(pixels, speech, origin, right, height, kPale);
  return whole;
}

void CaptionPainter::paintLabel(render::Image& image, const std::string& label) {
  const int height = std::max(7, image.height / 36);
  impl_->writeTag(pixelsOf(image), printableLine(label), {height / 2, height * 2}, height);
}

void CaptionPainter::paintTitle(render::Image& image, const std::string& title) {
  const std::string text = printableLine(title);
  const int height = impl_->heightFor(text, std::max(8, image.height / 14), image.width * 9 / 10);
  cv::Mat pixels = pixelsOf(image);
  const int middle = image.height / 2, band = std::min(middle, height * 3 / 2);
  darken(pixels.rowRange(middle - band, middle + band), 0.75);
  impl_->write(pixels, text,
               {(image.width - impl_->widthOf(text, height)) / 2, middle + height / 3}, height,
               kWhite);
}

void CaptionPainter::paintInset(render::Image& image, const render::Image& inset,
                                const std::string& label) {
  const auto lit = litPart(inset);
  if (!lit) return;
  const int margin = std::max(4, image.height / 45), text = std::max(8, image.height / 50);
  const int width = image.width * 15 / 100;
  const int height = width * inset.height / std::max(1, inset.width);
  const cv::Rect box(image.width - margin - width, margin, width, height + 2 * text);
  const cv::Rect whole(0, 0, image.width, image.height);
  if (width < 16 || height < 16 || (box & whole) != box) return;
  cv::Mat pixels = pixelsOf(image);
  darken(pixels(box), 0.8);
  const cv::Mat source(inset.height, inset.width, CV_8UC3,
                       const_cast<std::uint8_t*>(inset.rgb.data()));
  const cv::Rect part(lit->left, lit->top, lit->width, lit->height);
  const cv::Rect shown(box.tl(), cv::Size(width, height));
  cv::resize(source(part), pixels(shown), shown.size(), 0, 0, cv::INTER_AREA);
  cv::rectangle(pixels, box, {120, 125, 135}, 1);
  impl_->write(pixels, label, {box.x + text / 2, box.br().y - text / 2}, text, {205, 210, 220});
}

}  // namespace afterglow::nodes
