// For ThreadSanitizer builds of any program that uses Aravis. Its libraries and GLib are not instrumented: their locks are
// invisible, so every buffer they hand over looks like a race. Our own code stays under watch.
#if defined(__SANITIZE_THREAD__)
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libaravis-0.8.so\n"
         "called_from_lib:libgio-2.0.so\n"
         "called_from_lib:libgobject-2.0.so\n"
         "called_from_lib:libglib-2.0.so\n";
}
#endif
