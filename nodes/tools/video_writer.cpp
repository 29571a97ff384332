#include "nodes/tools/video_writer.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {
namespace {

void closeFd(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

}  // namespace

std::string partPath(const std::string& path) {
  const std::filesystem::path whole(path);
  return (whole.parent_path() / (whole.stem().string() + ".part" + whole.extension().string()))
      .string();
}

VideoWriter::VideoWriter(std::string path, int width, int height, int fps)
    : path_(std::move(path)), part_path_(partPath(path_)), width_(width), height_(height) {
  if (width <= 0 || height <= 0 || fps <= 0) {
    throw std::invalid_argument(fmt::format(
        "a video needs a positive size and frame rate, not {}x{} at {}", width, height, fps));
  }
  start(fps);
}

VideoWriter::~VideoWriter() {
  if (encoder_ > 0) {
    ::kill(encoder_, SIGKILL);
    waitForEncoder();
    std::remove(part_path_.c_str());
  }
  closeFd(images_fd_);
  closeFd(messages_fd_);
}

void VideoWriter::start(int fps) {
  int sockets[2] = {-1, -1};
  messages_fd_ = ::memfd_create("ffmpeg messages", MFD_CLOEXEC);
  if (messages_fd_ < 0 || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) {
    closeFd(messages_fd_);
    throw std::runtime_error(path_ + ": cannot start ffmpeg: " + std::strerror(errno));
  }
  ProgramStart start;
  start.input = sockets[0];
  start.error = messages_fd_;
  // Ctrl-C in a terminal must not end the encoder before the last image.
  start.leader = ProgramStart::Leader::OfGroup;
  images_fd_ = sockets[1];
  try {
    encoder_ = startProgram(encoderCommand(fps), start);
  } catch (const std::system_error& error) {
    ::close(sockets[0]);
    closeFd(images_fd_);
    closeFd(messages_fd_);
    throw std::runtime_error(path_ + ": cannot start ffmpeg (package ffmpeg): " +
                             error.code().message());
  }
  ::close(sockets[0]);
}

std::vector<std::string> VideoWriter::encoderCommand(int fps) const {
  return {"ffmpeg",
          "-hide_banner",
          "-loglevel",
          "error",
          "-nostdin",
          "-y",
          "-f",
          "rawvideo",
          "-pixel_format",
          "rgb24",
          "-video_size",
          fmt::format("{}x{}", width_, height_),
          "-framerate",
          std::to_string(fps),
          "-i",
          "pipe:0",
          "-vf",
          "scale=out_color_matrix=bt709,pad=ceil(iw/2)*2:ceil(ih/2)*2",
          "-colorspace",
          "bt709",
          "-c:v",
          "libx264",
          "-preset",
          "veryfast",
          "-g",
          "50",
          "-crf",
          "18",
          "-aq-mode",  // 3 keeps dark slopes from banding
          "3",
          "-pix_fmt",
          "yuv420p",
          "-movflags",
          "+faststart",
          "-f",
          "mp4",
          "file:" + part_path_};
}

void VideoWriter::write(const render::Image& image) {
  const std::size_t size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3;
  if (image.width != width_ || image.height != height_ || image.rgb.size() != size) {
    throw std::invalid_argument(fmt::format("{}: a frame of {}x{} in a video of {}x{}", path_,
                                            image.width, image.height, width_, height_));
  }
  for (std::size_t sent = 0; sent < size;) {
    const ssize_t count = ::send(images_fd_, image.rgb.data() + sent, size - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail("the encoder stopped");
    sent += static_cast<std::size_t>(count);
  }
  ++images_;
}

void VideoWriter::close() {
  closeFd(images_fd_);
  const int status = waitForEncoder();
  if (status != 0) fail("the encoder failed");
  if (images_ == 0) fail("no frame to show");
  std::error_code error;
  std::filesystem::rename(part_path_, path_, error);
  if (error) fail("cannot put the video in place: " + error.message());
}

int VideoWriter::waitForEncoder() {
  const int status = encoder_ > 0 ? waitForProgram(encoder_) : 0;
  encoder_ = -1;
  return status;
}

void VideoWriter::fail(const std::string& what) {
  closeFd(images_fd_);
  waitForEncoder();
  std::remove(part_path_.c_str());
  const std::string message = encoderMessage();
  throw std::runtime_error(path_ + ": " + what + (message.empty() ? "" : ": " + message));
}

std::string VideoWriter::encoderMessage() const {
  std::string text(4096, '\0');
  const ssize_t count = ::pread(messages_fd_, text.data(), text.size(), 0);
  text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

WorkFolder::WorkFolder(const std::string& file) : path_(file + ".parts.XXXXXX") {
  if (::mkdtemp(path_.data()) == nullptr) {
    throw std::runtime_error(path_ + ": cannot make the folder: " + std::strerror(errno));
  }
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string WorkFolder::path(const std::string& name) const { return path_ + "/" + name; }

std::string WorkFolder::folder(const std::string& name) const {
  std::filesystem::create_directory(path(name));
  return path(name);
}

}  // namespace afterglow::nodes
