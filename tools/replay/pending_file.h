#pragma once
// An output file that looks like one only when it is whole: written under a temporary name, renamed at the end.

#include <cstdio>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>

namespace plumb::replay {

/// What was to be kept could not be written. One message, exit code 1.
class WriteError : public std::runtime_error {
 public:
  explicit WriteError(const std::filesystem::path& file)
      : std::runtime_error(file.string() + ": writing failed; is the disk full?") {}
  WriteError(const std::filesystem::path& file, const std::string& problem)
      : std::runtime_error(file.string() + ": " + problem) {}
};

/// Keeps everyone else who asks for it from a file, this process included, until it goes.
class FileLock {
 public:
  FileLock() = default;
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  /// Makes the file if needed and locks it; leaves its content alone. False, with errno set, when it cannot be opened
  /// or somebody else has it (EWOULDBLOCK).
  bool take(const std::filesystem::path& file);

 private:
  int descriptor_ = -1;
};

class PendingFile {
 public:
  /// Creates FILE.partial, and the folder if needed. Throws InputError when that is not possible, when somebody else
  /// is writing it (another run, or another option of this one), or when either name is one of `inputs`: files that are
  /// read and folders in which everything may be.
  explicit PendingFile(std::filesystem::path file, std::span<const std::filesystem::path> inputs = {});
  /// Removes FILE.partial unless committed.
  ~PendingFile();
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;

  std::FILE* stream() { return stream_; }
  const std::filesystem::path& temporary_name() const { return temporary_; }
  /// Throws WriteError when something could not be written so far.
  void check() const;
  /// Flushes and closes. Throws WriteError when anything could not be written.
  void close();
  /// Removes the file of that name that an earlier run may have left. Throws WriteError.
  void remove_earlier() const;
  /// Gives the file its name. Throws WriteError. Precondition: close() was called.
  void commit();

 private:
  std::filesystem::path file_;
  std::filesystem::path temporary_;
  FileLock lock_;
  std::FILE* stream_ = nullptr;
  bool committed_ = false;
};

}  // namespace plumb::replay
