#include "nodes/verbs/contact_sheet.hpp"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>

namespace afterglow::nodes {
namespace {

cv::Mat pixelsOf(const render::Image& image) {
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.rgb.data())};
}

render::Image imageOf(const cv::Mat& pixels) {
  return {pixels.cols, pixels.rows, {pixels.datastart, pixels.dataend}};
}

}  // namespace

void ContactSheet::add(const std::vector<render::Image>& pictures, const Caption& caption) {
  cv::Mat cell;
  for (const render::Image& picture : pictures) {
    const std::int64_t height = std::int64_t{picture.height} * kCell / picture.width;
    cv::Mat part;
    cv::resize(pixelsOf(picture), part, {kCell, std::max(1, static_cast<int>(height))}, 0, 0,
               cv::INTER_AREA);
    cell.push_back(part);
  }
  cells_.push_back(painter_.withStrip(imageOf(cell.clone()), caption));
}

render::Image ContactSheet::image() const {
  const int count = static_cast<int>(cells_.size());
  if (count == 0) return {};
  const int height = cells_.front().height + kGap;
  const int rows = (count + kColumns - 1) / kColumns, columns = std::min(kColumns, count);
  cv::Mat sheet(rows * height + kGap, columns * (kCell + kGap) + kGap, CV_8UC3,
                cv::Scalar::all(96));
  for (int i = 0; i < count; ++i) {
    const cv::Mat cell = pixelsOf(cells_[static_cast<std::size_t>(i)]);
    cell.copyTo(sheet(cv::Rect({kGap + i % kColumns * (kCell + kGap), kGap + i / kColumns * height},
                               cell.size())));
  }
  return imageOf(sheet);
}

}  // namespace afterglow::nodes
