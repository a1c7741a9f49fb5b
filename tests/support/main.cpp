#include <gtest/gtest.h>

/// GoogleTest's main(), which also returns SKIP_RETURN_CODE to ctest if every test was skipped.
int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (const int status = RUN_ALL_TESTS(); status != 0) return status;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  return all.skipped_test_count() > 0 && all.successful_test_count() == 0 ? 77 : 0;
}
