function y({eye:r,planes:e},t,s,o=0,i=o){for(let a=0;a<e.length;a+=3){let h=0;for(let n=0;n<3;n++){let l=e[a+n];h+=((l>0?s[i+n]:t[o+n])-r[n])*l}if(!(h>0))return!1}return!0}function F(r,e,t,s=0,o=s){let i=0;for(let a=0;a<3;a++){let h=Math.max(e[s+a]-r[a],r[a]-t[o+a],0);i+=h*h}return Math.sqrt(i)}var se=({catalogue:r,frustum:e},t)=>!!e&&y(e,r.low,r.high,3*t);function U({catalogue:{meshes:r},cell:e,known:t,downloads:s}){return[...r.keys()].filter(o=>r[o+1]?.mesh!==r[o].mesh&&t[e]?.visible.includes(r[o].cell)&&s.has("geometry",r[o].cell))}function j(r,e){let{cell:t,here:s,known:o,downloads:i}=r,a=i.has("record",s)||!e("record",s)?0:1;for(let h of o[t]?.visible??[])(h===t||se(r,h))&&!i.has("geometry",h)&&e("geometry",h)&&a++;for(let h of U(r))!i.has("mesh",h)&&e("mesh",h)&&a++;return a}var re=.05,v=class{#e;#t;#r;#o;#a;#s;#n;#h;#l=0;#i=[];#c=1;constructor(e,t,s,o,i){let{T:a}=e.catalogue;this.#e=e,this.#t=t,this.#r=s,this.#o=o,this.#a=i,this.#s=new Float64Array(a),this.#n=new Int32Array(a),this.#h=new Int32Array(a).fill(-1),this.target=new Int32Array(a)}learned(){}look(){let{column:e,have:t}=this.#e;this.#u(),this.#d(),this.#f(this.#n,this.target),this.#m(this.#f(this.#n.map((s,o)=>Math.min(s,t[o])),e))}#u(){let{catalogue:{T:e,levels:t},downloads:s,frustum:o}=this.#e,i=this.#o(),a=new Float64Array(2*e);this.#s.fill(1/0),this.#l++;for(let[h,n]of this.#r)if(!(!o||!s.has("geometry",h)))for(let{texture:l,low:c,high:u,side:w}of n){if(!y(o,c,u))continue;let g=Math.max(F(o.eye,c,u),re);this.#s[l]=Math.min(this.#s[l],g);for(let f of[0,1])a[2*l+f]=Math.max(a[2*l+f],w[f]/(g*i))}for(let h=0;h<e;h++){if(this.#n[h]=0,this.#s[h]===1/0)continue;let n=this.#t[h].parts.filter(({joined:{width:l,height:c}})=>l<a[2*h]||c<a[2*h+1]).length;this.#n[h]=Math.min(n+1,t[h]),this.#h[h]=this.#l}}#d(){let e=this.#s,t=this.#a,s=o=>Math.floor(e[o]/8);this.#i=[],this.#n.forEach((o,i)=>{for(let a=1;a<=o;a++)this.#i.push([i,a])}),this.#i.sort(([o,i],[a,h])=>+t[o]-+t[a]||s(o)-s(a)||i-h||e[o]-e[a]||o-a)}#f(e,t){let{budget:s,catalogue:{K:o,memory:i}}=this.#e,a=s;t.fill(0);for(let[h,n]of this.#i){let l=i[h*o+n]-i[h*o+n-1];n>e[h]||t[h]!==n-1||l>a||(t[h]=n,a-=l)}return a}#m(e){let{catalogue:{K:t,memory:s},column:o,have:i}=this.#e,a=this.#h,h=[...a.keys()].filter(n=>a[n]>=0);h.sort((n,l)=>a[l]-a[n]||this.#s[n]-this.#s[l]||n-l);for(let n of h){let l=s[n*t+o[n]],c=o[n];for(;c<i[n]&&s[n*t+c+1]<=l+e;)c++;o[n]=c,e-=s[n*t+c]-l}}missing(e){let{have:t}=this.#e,s=this.target.reduce((o,i,a)=>o+ +(t[a]<i&&e("texture",a)),0);return j(this.#e,e)+s}next({concurrency:e}){let{catalogue:{K:t,ends:s},cell:o,here:i,known:a,downloads:h}=this.#e,n=[["record",i]];for(let l of a[o]?.visible??[])n.push(["geometry",l]);for(let l of U(this.#e))n.push(["mesh",l]);for(let[l,c]of n)if(h.free(l,c))return h.ask(l,c,-this.#c++);if(h.waiting.size>=e)return null;for(let[l,c]of this.#i){let u=s[l*t+c];if(!(c>this.target[l]||h.asked[l]>=u||!h.free("texture",l)))return h.ask("texture",l,-this.#c++,u)}return null}};var P=(r="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,ne=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,ie=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${ne}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,B=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,ae=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${B}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,he=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${B}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,G={surface:[P(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ie],item:[P(),ae],placeholder:[P(),he]};function X(r,e,t=G[e]){let s=r.createProgram(),o=[r.VERTEX_SHADER,r.FRAGMENT_SHADER];if(t.forEach((h,n)=>{let l=r.createShader(o[n]);r.shaderSource(l,h),r.compileShader(l),r.attachShader(s,l),r.deleteShader(l)}),r.linkProgram(s),!r.getProgramParameter(s,r.LINK_STATUS)&&!r.isContextLost())throw new Error(`${e}: ${r.getProgramInfoLog(s)}`);let i={},a=r.isContextLost()?0:r.getProgramParameter(s,r.ACTIVE_UNIFORMS);for(let h=0;h<a;h++){let n=r.getActiveUniform(s,h)?.name??"";i[n]=r.getUniformLocation(s,n)}return{program:s,at:i}}var le=Uint32Array.from({length:256},(r,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function D(r,e=0){let t=~e;for(let s=0;s<r.length;s++)t=le[(t^r[s])&255]^t>>>8;return~t>>>0}var ce=(r,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[r]);var E=ce("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var fe=Promise.resolve();var qe=2**24;var Ze=new Uint8Array([3,0]);function m(r,e){if(!r)throw new Error(e)}var T=(r,e,t)=>Number.isInteger(r)&&e<=r&&r<=t;var H={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},de=65536,me=2**30;function W(r){m(r?.format==="ptmtools interlaced image"&&r.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:s,files:o,kind:i,original:a}=r,h=l=>T(l,1,de);m(h(e)&&h(t)&&h(a?.width)&&h(a?.height),"no size"),m(s in H&&(i==="uint8"||i==="uint16"),"another container"),m(Array.isArray(o)&&T(o.length,1,33),"no files");let n={width:0,height:0};return o.forEach((l,c)=>{let{axis:u,joined:w}=l;m(l.name===`${c+1}.${s}`,"a file of another name"),m(h(l.width)&&h(l.height),"a file without size"),m(T(l.bytes,1,9*l.width*l.height+2**20),"a file of too many bytes"),m(T(l.crc32,0,4294967295)&&(c?u==="columns"||u==="rows":u===null),"no axis");let[g,f]=c?u==="columns"?[2,1]:[1,2]:[1,1];c||(n={width:l.width,height:l.height}),m(l.width===n.width&&l.height===n.height,"a file of another size"),n={width:g*n.width,height:f*n.height},m(w?.width===n.width&&w?.height===n.height,"a step of another size")}),m(n.width===e&&n.height===t,"steps that do not make the image"),r}var pe=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,ge=`#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before,next,pattern;
uniform vec2 size;
uniform bool pairs;
out vec4 texel;
void main(){
vec2 place=gl_FragCoord.xy/size;
vec4 added=texture(next,place);
if(pairs)added=added.rarr;
texel=texture(pattern,place*size/2.0).r==0.0?texture(before,place):added;
}`,we={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function xe(r,e){if(!e)return createImageBitmap(r,{colorSpaceConversion:"none"});let t=URL.createObjectURL(r),s=Object.assign(new Image,{src:t});return await s.decode().finally(()=>URL.revokeObjectURL(t)),s}function V(r,{container:e},{bytes:t,crc32:s}){return m(r.length===t&&D(r)===s,"another checksum"),new Blob([r],{type:H[e]})}async function N(r,{components:e},{width:t,height:s}){let o=await xe(r,e%2===0);return m(o.width===t&&o.height===s,"an image of another size"),o}var R=class{constructor(e){this.gl=e,this.use=X(e,"join",[pe,ge]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(we).map(([t,s])=>{let o=this.#e(2,2,e.R8);for(let i of[e.TEXTURE_WRAP_S,e.TEXTURE_WRAP_T])e.texParameteri(e.TEXTURE_2D,i,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(s)),[t,o]}))}upload(e){let{gl:t}=this,s=this.#e(e.width,e.height,t.RGBA8);return t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.texSubImage2D(t.TEXTURE_2D,0,0,0,t.RGBA,t.UNSIGNED_BYTE,e),"close"in e&&e.close(),s}join({axis:e,joined:{width:t,height:s}},o,i,a=4,h=!1){let{gl:n,use:{program:l,at:c}}=this,u=h?1+Math.floor(Math.log2(Math.max(t,s))):1,w=this.#e(t,s,a===1?n.R8:a===2?n.RG8:n.RGBA8,u);n.bindFramebuffer(n.FRAMEBUFFER,this.buffer),n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,w,0),n.viewport(0,0,t,s),n.disable(n.BLEND),n.useProgram(l);let g={before:o??i,next:i,pattern:this.patterns[e??"first"]};return Object.entries(g).forEach(([f,p],d)=>{n.activeTexture(n.TEXTURE0+d),n.bindTexture(n.TEXTURE_2D,p),p===o&&this.#t(n.NEAREST,n.NEAREST),n.uniform1i(c[f],d)}),n.activeTexture(n.TEXTURE0),n.uniform2f(c.size,t,s),n.uniform1i(c.pairs,+(a===2)),n.drawArrays(n.TRIANGLES,0,3),n.bindFramebuffer(n.FRAMEBUFFER,null),n.deleteTexture(o),n.deleteTexture(i),h&&(n.bindTexture(n.TEXTURE_2D,w),n.generateMipmap(n.TEXTURE_2D),this.#t(n.LINEAR_MIPMAP_LINEAR,n.LINEAR)),w}texels(e,t,s){let{gl:o}=this,i=new Uint8Array(4*t*s);return o.bindFramebuffer(o.FRAMEBUFFER,this.buffer),o.framebufferTexture2D(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,o.TEXTURE_2D,e,0),o.readPixels(0,0,t,s,o.RGBA,o.UNSIGNED_BYTE,i),o.bindFramebuffer(o.FRAMEBUFFER,null),i}#e(e,t,s,o=1){let{gl:i}=this,a=i.createTexture();i.bindTexture(i.TEXTURE_2D,a),i.texStorage2D(i.TEXTURE_2D,o,s,e,t),this.#t(i.NEAREST,i.NEAREST);for(let h of[i.TEXTURE_WRAP_S,i.TEXTURE_WRAP_T])i.texParameteri(i.TEXTURE_2D,h,i.CLAMP_TO_EDGE);return a}#t(e,t){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,e),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,t)}};function K(r,{files:e}){let t=r.getParameter(r.MAX_TEXTURE_SIZE),s=e.findIndex(({joined:{width:o,height:i}})=>Math.max(o,i)>t||4*o*i>me);return s<0?e.length:s}var Ee=3,O=class{#e=-1;constructor(e,t){this.gl=e,this.set=t,this.channels=t.channels,this.steps=0,this.texture=null}get bytes(){return this.steps?this.set.memory[this.steps-1]:0}add(e,t){let s=e.upload(t);this.texture=e.join(this.set.parts[this.steps],this.texture,s,this.channels,!0),this.steps++,this.#e=-1}bind(e,t){let{gl:s}=this,o=+e+2*+t;if(s.bindTexture(s.TEXTURE_2D,this.texture),o!==this.#e){let[i,a]=[e,t].map(h=>h?s.CLAMP_TO_EDGE:s.REPEAT);s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,i),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,a),this.#e=o}return!1}delete(){this.gl.deleteTexture(this.texture)}},k=class{image=null;constructor(e){this.joined=e}},b=class{#e;#t=new Map;#r=null;#o;#a;#s;constructor(e,t){this.gl=e,this.sets=t,this.#e=t.map(()=>null),this.held=new Int32Array(t.length),this.loss=new Float64Array(t.length),this.#o=new Int32Array(t.length),this.#s=new Int32Array(t.length),this.#a=new Float64Array(t.length),this.budget=1/0,this.peak=0,this.fades=!0}get bytes(){let e=[...this.#e,...[...this.#t.values()].map(t=>t.joined)];return[...new Set(e)].reduce((t,s)=>t+(s?.bytes??0),0)}of(e){return this.#e[e]}settle(e,t){this.#o.set(e),this.#a.set(t),this.#s.fill(0);for(let s=0;s<e.length;s++)e[s]===0&&this.#i(s);this.#n()}hold(){this.#o=this.held.map((e,t)=>Math.max(e,Math.min(this.#o[t],this.#s[t])))}resume(){this.#n()}#n(){let e=()=>[...this.#t.values()].filter(({image:s})=>!s).length,t=[...this.held.keys()].filter(s=>this.#o[s]>0&&this.held[s]!==this.#o[s]);t.sort((s,o)=>+(this.held[s]>0)-+(this.held[o]>0)||this.#a[o]-this.#a[s]);for(let s of t){if(e()>=Ee)break;if(this.#t.has(s))continue;let o=this.#e[s],i=o&&o.steps<this.#o[s];this.#h(s,i?o:new O(this.gl,this.sets[s]))}}#h(e,t){let s=new k(t);this.#t.set(e,s),this.sets[e].image(t.steps).then(o=>{this.#t.get(e)===s?s.image=o:"close"in o&&o.close()},()=>this.#l(e))}#l(e){let t=this.#t.get(e);this.#t.delete(e),t?.image&&"close"in t.image&&t.image.close(),t&&t.joined!==this.#e[e]&&t.joined.delete()}#i(e){this.#l(e),this.#e[e]?.delete(),this.#e[e]=null,this.held[e]=0}pump(e,t){let s=!1;for(let[o,{image:i,joined:a}]of[...this.#t]){if(!i)continue;if(t()&&s)break;this.#r??=new R(this.gl),a.add(this.#r,i),s=!0,this.peak=Math.max(this.peak,this.bytes),this.#t.delete(o);let h=this.#e[o],n=this.#o[o];!h||a===h||a.steps>=n?(a!==h&&h?.delete(),this.#e[o]=a,this.held[o]=a.steps):h.steps>n?this.#h(o,a):a.delete()}return s&&this.#n(),s}texels(e){let t=this.#e[e];if(!t||!this.#r)return null;let{width:s,height:o}=t.set.parts[t.steps-1].joined;return{width:s,height:o,texels:this.#r.texels(t.texture,s,o)}}delete(){for(let e=0;e<this.sets.length;e++)this.#i(e)}lose(){this.#s=this.held.map((e,t)=>Math.max(e,this.#s[t])),this.#e.fill(null),this.#t.clear(),this.#r=null,this.held.fill(0)}};var A=class{low=[1/0,1/0,1/0];high=[-1/0,-1/0,-1/0];#e=0;#t=[0,0];add(e,t,s){for(let o of e)this.low=this.low.map((i,a)=>Math.min(i,o[a])),this.high=this.high.map((i,a)=>Math.max(i,o[a]));this.#e+=t,this.#t=this.#t.map((o,i)=>o+t*s[i])}piece(e){let t=this.#t.map(s=>s>0?this.#e/s:0);return{texture:e,low:this.low,high:this.high,side:t}}};function S({positions:r,indices:e},t,s){let o=new A,i=Te(e,r.length/3),a=new Map;for(let h=0;h<e.length;h+=3){let n=e.subarray(h,h+3),l=Array.from(n,x=>Array.from(r.subarray(3*x,3*x+3))),[c,u]=[1,2].map(x=>l[x].map((M,_)=>M-l[0][_])),w=[0,1,2].map(x=>c[(x+1)%3]*u[(x+2)%3]-c[(x+2)%3]*u[(x+1)%3]),g=Math.hypot(...w);if(!(g>0))continue;let[f,p]=[0,1].map(x=>{let[M,_]=[1,2].map(I=>s[2*n[I]+x]-s[2*n[0]+x]);return Math.hypot(...c.map((I,te)=>_*I-M*u[te]))/g});if(o.add(l,g,[f,p]),a.size>256)continue;let d=i(n[0]),C=a.get(d)??new A;a.set(d,C),C.add(l,g,[f,p])}return(a.size>256?[o]:[...a.values()]).map(h=>h.piece(t))}function Te(r,e){let t=Uint32Array.from({length:e},(o,i)=>i),s=o=>{for(;t[o]!==o;)o=t[o]=t[t[o]];return o};return r.forEach((o,i)=>{i%3&&(t[s(o)]=s(r[i-1]))}),s}function ye({width:r,height:e}){let t=r*e;for(;r>1||e>1;)[r,e]=[Math.max(1,r>>1),Math.max(1,e>>1)],t+=r*e;return t}var L=class{#e=[];#t=null;constructor(e,t,s,o){this.index=e,this.urls=t,this.channels=o,this.parts=e.files.slice(0,s);let i=0;this.ends=this.parts.map(({bytes:a})=>i+=a),this.memory=this.parts.map(({joined:a})=>o*ye(a))}step(e){return this.ends.filter(t=>t<=e).length}async take(e,t){let s=this.parts[e],o=V(t,this.index,s),i=await N(o,this.index,s);this.#r(),this.#t=i,this.#e[e]=o}async image(e){let t=this.#t;return t&&e===this.#e.length-1?(this.#t=null,t):N(this.#e[e],this.index,this.parts[e])}#r(){this.#t&&"close"in this.#t&&this.#t.close(),this.#t=null}};function Y(r,e,t,s){return m(r?.format==="ptmtools interlaced images"&&r.schema===1,"not a document of interlaced images"),m(Array.isArray(r.sets)&&r.sets.length===e.length,"other textures"),e.map((o,i)=>{let{manifest:a,files:h}=r.sets[i]??{},n=W(a);m(n.components===o.components,"another texture"),m(Array.isArray(h)&&h.length===n.files.length,"files without names");let l=K(s,n);return m(l>0,"an image larger than this graphics card's textures"),new L(n,h.map(c=>t(String(c))),l,o.gpuTexelBytes)})}function q(r,{ends:e,parts:t}){let{width:s,height:o}=t[t.length-1].joined;return{...r,width:s,height:o,ends:e,differences:e.map(()=>0),previews:[],offsets:void 0}}function Z(r,e){let t=r.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function Q(r,e={},...t){let s=document.createElement(r);for(let[o,i]of Object.entries(e))o in s?Reflect.set(s,o,i):s.setAttribute(o,i);return s.append(...t),s}var J=8e3;function ee(r,...e){let t=Q("p",{},...e);Z(r,"#notices").append(t);let s=()=>{t.contains(r.activeElement)?setTimeout(s,J):t.remove()};setTimeout(s,J)}async function yt(r,e,t,s){let{index:o}=r;if(!o.sets)return ee(document,E.noSets),null;let i=r.of(o.sets),a=n=>new URL(n,i).href,h=await s.whole(i,n=>Y(JSON.parse(new TextDecoder().decode(n)),o.textures,a,e));return t.opening=null,r.index={...o,textures:o.textures.map((n,l)=>q(n,h[l]))},n=>ve(n,h)}function ve(r,e){let{client:t,client:{catalogue:s},gl:o,picture:i,rows:a}=r,{K:h,T:n,memory:l}=s,c=r.index.textures.map(f=>f.normals===!0);for(let f=0;f<n;f++){for(let p=1;p<h;p++)l[f*h+p]=e[f].memory[p-1]??l[f*h+p-1];a[f].sizes=e[f].parts}s.whole=e.reduce((f,{memory:p})=>f+p[p.length-1],0),r.firstLevels=1,Re(r,e);let u=new Map,w=t.learnGeometry.bind(t);t.learnGeometry=(f,p)=>{u.set(f,p.flatMap(d=>[...d.uvs?S(d,d.texture,d.uvs):[],...d.spots?S(d,d.light,d.spots):[],...d.frames&&c[d.relief]?S(d,d.relief,d.frames[0]):[]])),w(f,p)};let g=()=>2/r.viewport.across(Math.PI/2);t.policy=()=>new v(t,e,u,g,c),r.policy="gpuii",r.memory.delete(),r.memory=i.renderer.memory=new b(o,e),r.choose=r.compare=()=>r.emit("notice",{message:E.fixed})}function Re({client:r,stream:e,stream:{fetcher:t}},s){let{bytes:o}=r.downloads,i=e.url.bind(e),a=t.range.bind(t),h=(l,c=o[l])=>s[l].urls[s[l].step(c)];e.url=(l,c)=>l==="texture"?h(c):i(l,c);let n=new Map(s.flatMap(({urls:l},c)=>l.map(u=>[u,c])));t.range=async(l,c,u,w,...g)=>{let f=n.get(l);if(f===void 0)return a(l,c,u,w,...g);let p=await t.whole(l,async d=>(await s[f].take(s[f].step(c),d),d),...g);return{begin:c,body:p}},e.files=s.map(l=>({row:l,length:0,append(c,{length:u}){this.length=c+u}}))}export{yt as setsOf};
