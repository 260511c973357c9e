/// The program `wienertree`: parsing, progress, files and pictures around the library.
#include "command_line.hpp"
#include "interruption.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  using namespace wienertree::app;
  install_signal_handlers();
  CLI::App program;
  describe_program(program);
  return run_program(program, argc, argv);
}
