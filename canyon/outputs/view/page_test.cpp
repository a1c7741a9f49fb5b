#include "canyon/outputs/view/page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/output_file.hpp"
#include "canyon/outputs/encoding/view_tables.hpp"
#include "canyon/outputs/view/header.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::view {
namespace {

using testing::HasSubstr;
using testing::Not;

class PageTest : public testing::Test {
 protected:
  PageTest() {
    std::filesystem::create_directories(view_);
    write_file(view_ / "city.glb.gz", encoding::gzip("city"));
    write_file(view_ / "track-0.bin.gz", encoding::gzip("track"));
    write_file(folder_ / "secret.gz", encoding::gzip("track"));
    write_file(folder_ / "page.html", "<p><!--canyon:data--></p>");
    name_files("city.glb.gz", "track-0.bin.gz");
  }
  void name_files(const std::string& city, const std::string& chunk) const {
    write_file(view_ / kHeaderFile,
               R"({"city":{"file":")" + city + R"("},"chunks":[{"file":")" + chunk + R"(","bytes":5}]})");
  }
  [[nodiscard]] std::string refused() const {
    return test::refusal([&] { (void)export_page(folder_ / "page.html", view_, folder_ / "out.html"); });
  }

  test::TemporaryFolder folder_;
  std::filesystem::path view_ = folder_ / "view";
};

TEST_F(PageTest, HoldsTheFilesOfTheView) {
  EXPECT_EQ(refused(), "");
  EXPECT_THAT(read_bytes(folder_ / "out.html"), AllOf(HasSubstr("data-canyon-file=\"city.glb.gz\""),
                                                      HasSubstr("data-canyon-file=\"track-0.bin.gz\"")));
}

TEST_F(PageTest, HoldsNothingFromOutsideTheFolder) {
  for (const std::string& name : {std::string("../secret.gz"), (folder_ / "secret.gz").string(),
                                  std::string("x/../../secret.gz"), std::string("."), std::string()}) {
    name_files("city.glb.gz", name);
    EXPECT_NE(refused(), "") << name;
    name_files(name, "track-0.bin.gz");
    EXPECT_NE(refused(), "") << name;
  }
  for (const char* file : {"track-0.bin.gz", "city.glb.gz", kHeaderFile}) {
    name_files("city.glb.gz", "track-0.bin.gz");
    std::filesystem::rename(view_ / file, folder_ / "outside");
    std::filesystem::create_symlink(folder_ / "outside", view_ / file);
    EXPECT_THAT(refused(), HasSubstr("an invalid file name")) << file;
    std::filesystem::rename(folder_ / "outside", view_ / file);
  }
  EXPECT_EQ(refused(), "");
}

TEST_F(PageTest, NamesThatAreHtmlAreRefused) {
  const std::string name = "x.gz\\\"><script>1<";  // as in JSON
  write_file(view_ / "x.gz\"><script>1<", encoding::gzip("track"));
  name_files("city.glb.gz", name);
  EXPECT_THAT(refused(), HasSubstr("an invalid file name"));
}

}  // namespace
}  // namespace canyon::view
