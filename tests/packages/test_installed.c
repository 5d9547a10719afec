// `make install` into a stage: exported symbols, headers, consumers through pkg-config and CMake that learn a motor.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_it_installs(void) { tool_passes("tests/packages/installed.sh stage"); }
static void test_the_public_interface_is_exported_and_no_more(void)
{
    tool_passes("tests/packages/installed.sh exports");
}
static void test_each_installed_header_stands_alone(void) { tool_passes("tests/packages/installed.sh headers"); }
static void test_a_consumer_by_pkg_config_learns(void) { tool_passes("tests/packages/installed.sh pkgconfig"); }
static void test_a_consumer_by_find_package_learns(void) { tool_passes("tests/packages/installed.sh find_package"); }
static void test_a_consumer_by_add_subdirectory_learns(void)
{
    tool_passes("tests/packages/installed.sh add_subdirectory");
}
static void test_a_consumer_of_what_cmake_installs_learns(void)
{
    tool_passes("tests/packages/installed.sh cmake_install");
}
static void test_a_consumer_by_fetchcontent_learns(void) { tool_passes("tests/packages/installed.sh fetchcontent"); }
static void test_another_size_does_not_link(void) { tool_passes("tests/packages/installed.sh sizes"); }
static void test_man_has_nothing_to_say_of_the_pages(void) { tool_passes("tests/packages/installed.sh manual"); }
static void test_the_binary_interface_is_the_one_that_is_kept(void) { tool_passes("tests/packages/installed.sh abi"); }
static void test_one_version_everywhere(void) { tool_passes("tests/packages/installed.sh version"); }
static void test_uninstall_leaves_what_is_not_ours(void) { tool_passes("tests/packages/installed.sh uninstall"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_installs);
    RUN_TEST(test_the_public_interface_is_exported_and_no_more);
    RUN_TEST(test_each_installed_header_stands_alone);
    RUN_TEST(test_a_consumer_by_pkg_config_learns);
    RUN_TEST(test_a_consumer_by_find_package_learns);
    RUN_TEST(test_a_consumer_by_add_subdirectory_learns);
    RUN_TEST(test_a_consumer_of_what_cmake_installs_learns);
    RUN_TEST(test_a_consumer_by_fetchcontent_learns);
    RUN_TEST(test_another_size_does_not_link);
    RUN_TEST(test_man_has_nothing_to_say_of_the_pages);
    RUN_TEST(test_the_binary_interface_is_the_one_that_is_kept);
    RUN_TEST(test_one_version_everywhere);
    RUN_TEST(test_uninstall_leaves_what_is_not_ours);
    return UNITY_END();
}
