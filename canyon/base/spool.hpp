#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace canyon {

/// Texts that grow side by side and are read at the end of a run of any length. All but their last bytes wait
/// in one file in the folder for temporary files, which has no name and goes with the process.
class Spool {
 public:
  /// One of the texts. The spool must outlive it.
  class Text {
   public:
    explicit Text(Spool& spool) : spool_(&spool) {}
    /// Throws OutputError where the disk does not take it.
    void add(std::string_view bytes);
    [[nodiscard]] bool empty() const { return rest_.empty() && places_.empty(); }
    void read(const std::function<void(std::string_view)>& put) const;

   private:
    Spool* spool_;
    std::string rest_;
    std::vector<std::uint32_t> places_;  // of its blocks in the file
  };

 private:
  static constexpr std::size_t kBlock = std::size_t{16} * 1024;

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;  // null: nothing waits in it yet
  std::uint32_t blocks_ = 0;
};

}  // namespace canyon
