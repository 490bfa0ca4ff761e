// Marks functions that are compiled for one instruction set and run only where simd_path.h finds it. GCC has
// to be told to use the whole width of the vectors; clang does so unasked and does not know the word.
#pragma once

#if defined(__clang__)
#define FORGESCAN_AVX2 "avx2"
#define FORGESCAN_AVX512 "avx512f,avx512bw,avx512vl,avx512dq"
#else
#define FORGESCAN_AVX2 "avx2,prefer-vector-width=256"
#define FORGESCAN_AVX512 "avx512f,avx512bw,avx512vl,avx512dq,prefer-vector-width=512"
#endif
#if defined(__x86_64__)
#define FORGESCAN_TARGET_AVX2 [[gnu::target(FORGESCAN_AVX2)]]
#define FORGESCAN_TARGET_AVX512 [[gnu::target(FORGESCAN_AVX512)]]
#else
#define FORGESCAN_TARGET_AVX2
#define FORGESCAN_TARGET_AVX512
#endif
