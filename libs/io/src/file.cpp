#include "toile/io/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace toile::io {
namespace {

std::string system_reason() { return std::strerror(errno); }

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

}  // namespace

Result<std::string> read_file(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info {};
  if (file.get() < 0 || ::fstat(file.get(), &info) != 0) {
    return Issue{"cannot_read", {.file = path}, "cannot be read: " + system_reason(), "check the path and its permissions"};
  }
  if (S_ISDIR(info.st_mode)) return Issue{"cannot_read", {.file = path}, "is a folder", "name a file"};
  std::string bytes(static_cast<std::size_t>(info.st_size), '\0');
  std::size_t done = 0;
  while (true) {
    if (done == bytes.size()) bytes.resize(bytes.size() + 65536);  // pipes have no size; a regular file ends below
    const ssize_t count = ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return Issue{"cannot_read", {.file = path}, "cannot be read: " + system_reason(), "check the disk"};
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  bytes.resize(done);
  return bytes;
}

Issues write_file(const std::string& path, std::string_view bytes) {
  const auto failed = [&](const char* action) {
    return Issues{{"cannot_write", {.file = path}, std::string(action) + ": " + system_reason(), "check the folder, its permissions and the free space"}};
  };
  // A device or a pipe (/dev/stdout) cannot be replaced by renaming; it is written to as it is.
  struct stat info {};
  const bool special = ::stat(path.c_str(), &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode);
  const std::string temporary = special ? path : fmt::format("{}.{}.part", path, ::getpid());
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) return failed("cannot be written");
  const auto abandon = [&](const char* action) {
    Issues issues = failed(action);
    if (!special) ::unlink(temporary.c_str());
    return issues;
  };
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::write(file.get(), bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return abandon("cannot be written");
    done += static_cast<std::size_t>(count);
  }
  if (!special && ::fsync(file.get()) != 0) return abandon("cannot be flushed to disk");
  if (::close(file.release()) != 0) return abandon("cannot be closed");
  if (!special && ::rename(temporary.c_str(), path.c_str()) != 0) return abandon("cannot be put in place");
  return {};
}

}  // namespace toile::io
