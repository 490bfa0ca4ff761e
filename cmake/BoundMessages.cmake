# lcm-gen's C++ believes what a message says of itself: it makes room for as many elements as the message says it has before it
# looks whether they are there, so that 100 bytes ask for gigabytes; and of a text of less than no bytes it copies two gigabytes
# from behind the message. This puts the look first; every element, and the end of every text, takes at least a byte.
# cmake -DHEADER=FILE -P BoundMessages.cmake
file(READ ${HEADER} TEXT)
string(REGEX MATCHALL "\\.(resize|assign)\\(" FOUND "${TEXT}")
string(REGEX REPLACE "(this->[^\n]*)\\.resize\\((this->[a-zA-Z0-9_]+)\\)"
       "if(\\2 < 0 || \\2 > maxlen - pos) return -1;\n        \\1.resize(\\2)" TEXT "${TEXT}")
string(REGEX REPLACE "if\\((__[a-zA-Z0-9_]+) > maxlen - pos\\)" "if(\\1 < 1 || \\1 > maxlen - pos)" TEXT "${TEXT}")
string(REPLACE ";" "" PLAIN "${TEXT}")  # which would part list elements
string(REGEX MATCHALL "> maxlen - pos\\) return -1\n *this->[^\n]*\\.(resize|assign)\\(" BOUNDED "${PLAIN}")
list(LENGTH FOUND FOUND)
list(LENGTH BOUNDED BOUNDED)
if(NOT FOUND EQUAL BOUNDED)
  file(REMOVE ${HEADER})
  message(FATAL_ERROR "${HEADER}: makes room ${FOUND} times, ${BOUNDED} could be bounded; lcm-gen writes another code than known")
endif()
file(WRITE ${HEADER} "${TEXT}")
