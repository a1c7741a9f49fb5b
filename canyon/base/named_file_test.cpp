#include "canyon/base/input_files.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon {
namespace {

namespace fs = std::filesystem;

TEST(NamedFile, LiesInTheFolderOfTheFile) {
  const test::TemporaryFolder folder;
  for (const char* name : {"in/sub/a.bin", "in/b.bin", "out.bin"}) {
    fs::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << "data";
  }
  fs::create_symlink(folder / "out.bin", folder / "in/link.bin");
  fs::create_directory_symlink(folder.path(), folder / "in/up");
  fs::create_directory_symlink(folder / "in", folder / "way");
  std::ofstream(folder / "in/x.gltf") << "{}";
  fs::create_symlink(folder / "in/x.gltf", folder / "x.gltf");
  const fs::path by = folder / "in/x.gltf";
  const std::string whole = (folder / "in/b.bin").string();
  for (const std::string& name :
       {std::string("b.bin"), std::string("./sub/../b.bin"), std::string("sub/a.bin"),
        std::string("../in/b.bin"), std::string("up/in/b.bin"), whole, "file://" + whole,
        std::string("absent.bin")})
    EXPECT_EQ(test::refusal([&] { (void)file_named_by(by, name); }), "") << name;
  for (const std::string& name :
       {std::string("../out.bin"), std::string("sub/../../out.bin"), std::string("link.bin"),
        std::string("up/out.bin"), std::string("/etc/passwd"), std::string("file:///etc/passwd"),
        (folder / "out.bin").string(), std::string("../in2/b.bin")})
    EXPECT_NE(test::refusal([&] { (void)file_named_by(by, name); }).find("is outside the folder"),
              std::string::npos)
        << name;
  // If the file is a link, files next to the link and next to its target count; so do links of folders.
  EXPECT_TRUE(is_in_folder_of(folder / "in/b.bin", folder / "x.gltf"));
  EXPECT_TRUE(is_in_folder_of(folder / "out.bin", folder / "x.gltf"));
  EXPECT_TRUE(is_in_folder_of(folder / "way/b.bin", folder / "way/x.gltf"));
  EXPECT_FALSE(is_in_folder_of(folder / "way/../out.bin", folder / "way/x.gltf"));
  EXPECT_TRUE(is_in_folder_of(folder / "out.bin", by, ".."));
  EXPECT_FALSE(is_in_folder_of(folder / "in/b.bin", by, "sub"));
}

}  // namespace
}  // namespace canyon
