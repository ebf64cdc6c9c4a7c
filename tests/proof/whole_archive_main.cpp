// Nothing but what is linked with it: the symbol check reads the whole archives in one program.
int main() { return 0; }
