# Heat maps over several machines (CANYON_BUILD_MPI): canyon_heatmap_engine knows MPI, nothing else does.
target_compile_definitions(canyon_heatmap_engine PRIVATE CANYON_WITH_MPI)
if(NOT CANYON_BUILD_TESTS)
  return()
endif()
function(canyon_mpi_test name filter)
  add_test(NAME heatmap/${name}
           COMMAND ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG} 2 $<TARGET_FILE:test_heatmap_engine>
                   --gtest_filter=${filter} --gtest_also_run_disabled_tests)
  # Open MPI 4 and 5: as root (containers), and on machines of one core.
  set_tests_properties(heatmap/${name} PROPERTIES TIMEOUT 120 ENVIRONMENT
    "OMPI_ALLOW_RUN_AS_ROOT=1;OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1;OMPI_MCA_rmaps_base_oversubscribe=1;PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe")
endfunction()
canyon_mpi_test(two_ranks Mpi.*)
canyon_mpi_test(lost_rank MpiFailure.*)
# The launcher's exit status says that the job failed; one that hangs runs into the time limit, which fails too.
set_tests_properties(heatmap/lost_rank PROPERTIES WILL_FAIL TRUE)
