#include "nodes/tools/video_writer.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

namespace afterglow::nodes {
namespace {

std::string partPath(const std::string& path) {
  const std::filesystem::path whole(path);
  return (whole.parent_path() / (whole.stem().string() + ".part" + whole.extension().string()))
      .string();
}

void closeFd(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

/// Starts ffmpeg with its standard input and error where they should be; the error number, or 0.
int spawn(const std::vector<std::string>& arguments, int input, int error, pid_t& pid) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, error, STDERR_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  // Its own process group: Ctrl-C in a terminal must not end the encoder before the last frame.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int result = posix_spawnp(&pid, argv.front(), &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return result;
}

}  // namespace

VideoWriter::VideoWriter(std::string path, int width, int height, int fps)
    : path_(std::move(path)), part_path_(partPath(path_)), width_(width), height_(height) {
  if (width <= 0 || height <= 0 || fps <= 0) {
    throw std::invalid_argument("a video needs a positive size and frame rate, not " +
                                std::to_string(width) + "x" + std::to_string(height) + " at " +
                                std::to_string(fps));
  }
  start(fps);
}

VideoWriter::~VideoWriter() {
  if (encoder_ > 0) {
    ::kill(encoder_, SIGKILL);
    waitForEncoder();
    std::remove(part_path_.c_str());
  }
  closeFd(frames_fd_);
  closeFd(messages_fd_);
}

void VideoWriter::start(int fps) {
  int sockets[2] = {-1, -1};
  messages_fd_ = ::memfd_create("ffmpeg messages", MFD_CLOEXEC);
  if (messages_fd_ < 0 || ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) {
    closeFd(messages_fd_);
    throw std::runtime_error(path_ + ": cannot start ffmpeg: " + std::strerror(errno));
  }
  const int error = spawn({"ffmpeg",
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
                           std::to_string(width_) + "x" + std::to_string(height_),
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
                           "-crf",
                           "18",
                           "-pix_fmt",
                           "yuv420p",
                           "-movflags",
                           "+faststart",
                           "-f",
                           "mp4",
                           "file:" + part_path_},
                          sockets[0], messages_fd_, encoder_);
  ::close(sockets[0]);
  frames_fd_ = sockets[1];
  if (error != 0) {
    encoder_ = -1;
    closeFd(frames_fd_);
    closeFd(messages_fd_);
    throw std::runtime_error(path_ +
                             ": cannot start ffmpeg (package ffmpeg): " + std::strerror(error));
  }
}

void VideoWriter::write(const render::Image& image) {
  const std::size_t size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3;
  if (image.width != width_ || image.height != height_ || image.rgb.size() != size) {
    throw std::invalid_argument(path_ + ": a frame of " + std::to_string(image.width) + "x" +
                                std::to_string(image.height) + " in a video of " +
                                std::to_string(width_) + "x" + std::to_string(height_));
  }
  for (std::size_t sent = 0; sent < size;) {
    const ssize_t count = ::send(frames_fd_, image.rgb.data() + sent, size - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail("the encoder stopped");
    sent += static_cast<std::size_t>(count);
  }
  ++frames_;
}

void VideoWriter::close() {
  closeFd(frames_fd_);
  const int status = waitForEncoder();
  if (status != 0) fail("the encoder failed");
  if (frames_ == 0) fail("no frame to show");
  std::error_code error;
  std::filesystem::rename(part_path_, path_, error);
  if (error) fail("cannot put the video in place: " + error.message());
}

int VideoWriter::waitForEncoder() {
  int status = 0;
  while (encoder_ > 0 && ::waitpid(encoder_, &status, 0) < 0 && errno == EINTR) {
  }
  encoder_ = -1;
  return status;
}

void VideoWriter::fail(const std::string& what) {
  closeFd(frames_fd_);
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

}  // namespace afterglow::nodes
