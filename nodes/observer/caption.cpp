#include "nodes/observer/caption.hpp"

#include <algorithm>
#include <filesystem>
#include <opencv2/freetype.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

const cv::Scalar kWhite(255, 255, 255), kPale(150, 215, 255), kDark(12, 14, 18);
constexpr double kBarOpacity = 0.62;

cv::Mat pixelsOf(render::Image& image) {
  return {image.height, image.width, CV_8UC3, image.rgb.data()};
}

void darken(cv::Mat pixels, double opacity) { pixels = pixels * (1 - opacity) + kDark * opacity; }

/// The same word always has the same color; "replay" glows like the light it is about.
cv::Scalar tagColor(const std::string& tag) {
  return tag == "replay" ? cv::Scalar(236, 110, 20) : cv::Scalar(30, 120, 190);
}

/// One line, without what a font has no glyph for.
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
  void write(cv::Mat pixels, const std::string& text, cv::Point origin, int height,
             const cv::Scalar& color) {
    font->putText(pixels, text, origin, height, color, -1, cv::LINE_AA, true);
  }
  /// How far the text may go on after the tag.
  int writeTag(cv::Mat pixels, const std::string& tag, cv::Point origin, int height);
  void writeLine(cv::Mat pixels, const std::string& text, cv::Point origin, int height,
                 const cv::Scalar& color);
};

int CaptionPainter::Impl::writeTag(cv::Mat pixels, const std::string& tag, cv::Point origin,
                                   int height) {
  const int pad = height / 2, width = widthOf(tag, height);
  cv::rectangle(pixels, {origin.x, origin.y - height - pad / 2},
                {origin.x + width + 2 * pad, origin.y + pad}, tagColor(tag), cv::FILLED);
  write(pixels, tag, {origin.x + pad, origin.y}, height, kWhite);
  return origin.x + width + 3 * pad;
}

void CaptionPainter::Impl::writeLine(cv::Mat pixels, const std::string& text, cv::Point origin,
                                     int height, const cv::Scalar& color) {
  const int room = pixels.cols - 2 * height - origin.x;
  write(pixels, text, origin, heightFor(text, height, room), color);
}

Caption parseCaption(const std::string& message) {
  const std::size_t bar = message.find('|');
  if (bar == std::string::npos) return {"", message, ""};
  return {message.substr(0, bar), message.substr(bar + 1), ""};
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

void CaptionPainter::paint(render::Image& image, const Caption& caption) {
  const std::string text = printableLine(caption.text), tag = printableLine(caption.tag);
  const std::string speech =
      caption.speech.empty() ? "" : "“" + printableLine(caption.speech) + "”";
  const int lines = (text.empty() && tag.empty() ? 0 : 1) + (speech.empty() ? 0 : 1);
  if (lines == 0) return;
  cv::Mat pixels = pixelsOf(image);
  const int height = std::max(10, image.height / 30);
  const int line = 2 * height, bar = std::min(image.height, lines * line + height / 2);
  darken(pixels.rowRange(image.height - bar, image.height), kBarOpacity);
  cv::Point origin(height, image.height - bar + line - height / 3);
  if (!text.empty() || !tag.empty()) {
    cv::Point after_tag = origin;
    if (!tag.empty()) after_tag.x = impl_->writeTag(pixels, tag, origin, height * 4 / 5);
    impl_->writeLine(pixels, text, after_tag, height, kWhite);
    origin.y += line;
  }
  if (!speech.empty()) impl_->writeLine(pixels, speech, origin, height, kPale);
}

void CaptionPainter::paintInset(render::Image& image, const render::Image& inset,
                                const std::string& label) {
  const int margin = std::max(4, image.height / 45), text = std::max(8, image.height / 50);
  const int width = image.width * 23 / 100;
  const int height = width * inset.height / std::max(1, inset.width);
  const cv::Rect box(image.width - margin - width, margin, width, height + 2 * text);
  const cv::Rect whole(0, 0, image.width, image.height);
  if (width < 16 || height < 16 || (box & whole) != box) return;
  cv::Mat pixels = pixelsOf(image);
  darken(pixels(box), 0.8);
  const cv::Mat source(inset.height, inset.width, CV_8UC3,
                       const_cast<std::uint8_t*>(inset.rgb.data()));
  cv::resize(source, pixels(cv::Rect(box.tl(), cv::Size(width, height))), {width, height}, 0, 0,
             cv::INTER_AREA);
  cv::rectangle(pixels, box, {120, 125, 135}, 1);
  impl_->write(pixels, label, {box.x + text / 2, box.br().y - text / 2}, text, {205, 210, 220});
}

}  // namespace afterglow::nodes
