/// Writes the manual page and the completions into a directory: part of the build.
#include <fstream>
#include <iostream>

#include "pages.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  using namespace wienertree::app;
  if (argc != 2) return 2;
  CLI::App program;
  describe_program(program);
  const std::string directory = argv[1];
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream file(directory + "/" + name);
    file << text << std::flush;
    if (!file) std::cerr << directory << "/" << name << ": cannot be written\n";
    return static_cast<bool>(file);
  };
  return write("wienertree.1", manual_page(program)) && write("wienertree.bash", bash_completion(program)) &&
                 write("_wienertree", zsh_completion(program)) &&
                 write("wienertree.fish", fish_completion(program))
             ? 0
             : 1;
}
