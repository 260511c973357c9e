// The same with a model as text. argv[1]: a model file.
#include <wienertree/model/text_model.hpp>

int main(int argc, char** argv) {
  return argc == 2 && wienertree::load_model(argv[1]).name == "benes" ? 0 : 1;
}
